"""What does not fit the current asked for is told, once, whatever it is."""

import re

import pytest
from short_runs import SHORT

from sim_backend.bench import open_bench
from sim_backend.serial_line import wires
from sim_backend.serial_line.faults import SerialFault
from tactile_lab.acquisition import live
from tactile_lab.acquisition.events import CoilCurrent, Message, RunState
from tactile_lab.bench import Reading
from tactile_lab.planning.needs import needs
from tactile_lab.planning.plan import plan
from tactile_lab.scene.load import load

MEASURED = 'record.signals=["V_C1", "coil_current", "field"]'


def warnings(ran):
    assert ran.done.state is RunState.COMPLETE, ran.done.reason
    return [one.text for one in ran.told if isinstance(one, Message)]


def with_field(factor):
    """A bench whose teslameter reads `factor` times the field."""

    def bench(scene):
        made = open_bench(scene, needs(scene))
        read = made.field_meter.read

        def other():
            reading = read()
            return Reading(reading.time, factor * reading.value)

        made.field_meter.read = other
        return made

    return bench


def test_what_fits_is_not_remarked_on(run_scene):
    assert warnings(run_scene(*SHORT, MEASURED)) == []


def test_a_port_that_got_another_name_is_told(run_scene):
    def moved(scene):
        made = open_bench(scene, needs(scene))
        settings = made.coil.settings
        made.coil.settings = lambda: settings() | {"moved": "It is at another port."}
        return made

    ran = run_scene(*SHORT, "protocol.hold=0.3 s", bench=moved)
    assert warnings(ran) == ["It is at another port."]


def test_a_short_hold_with_a_short_rest_is_not_doubted(run_scene):
    """The shunt's mean ended with the trial, that of the read-back 0.2 s later."""
    short = ("protocol.hold=0.3 s", "protocol.rest=0.1 s")
    assert warnings(run_scene(*SHORT, *short, MEASURED)) == []


def test_a_ramp_that_the_slew_limit_holds_back_is_told_as_planned_and_no_more(
    run_scene,
):
    """Link, panel and leads were to be checked, for a limit that the plan knew."""
    keys = (*SHORT, "protocol.ramp=50 ms", "protocol.hold=0.5 s", FORCE)
    planned = plan(load("demo", keys)).warnings
    told = [text for text in planned if "5 A/s is the slew limit" in text]
    assert len(told) == 1
    assert warnings(run_scene(*keys)) == []
    assert told[0] in run_scene(*keys).stored().info["warnings"]


FORCE = 'record.signals=["force"]'


def test_a_current_that_a_late_source_never_reached_is_told(run_scene):
    """Each late answer may mean a late step, so that the next one must be small."""
    late = SerialFault(kind="late", amount=0.15, times=None, line=r"^CURR 0\.\d*[1-9]")

    def slow(scene):
        return open_bench(scene, needs(scene), coil_faults=[late])

    told = warnings(run_scene(*SHORT, FORCE, bench=slow))
    assert any(
        "it asks for 996.9 mA in its hold, and the source gave" in t for t in told
    )


@pytest.mark.parametrize("hold", ["0.45 s", "0.8 s"])
@pytest.mark.parametrize("amperes", [0.0, 1.5])
def test_a_source_set_by_hand_in_a_short_hold_is_told(run_scene, amperes, hold):
    """The driver wants three readings that deviate, and the hold is over before."""

    def by_hand(execution, event):
        if isinstance(event, CoilCurrent) and event.setpoint > 0.99:
            far = [far for name, far in wires._far_ends.items() if "coil" in name][-1]
            far.instrument.set_current(amperes)

    ran = run_scene(*SHORT, f"protocol.hold={hold}", FORCE, watch=by_hand)
    (told,) = warnings(ran)
    assert "200 mN: it asks for 996.9 mA in its hold, and the source gave" in told


@pytest.mark.parametrize("factor", [0.5, 0.0, -1.0, 2.0])
def test_a_field_that_does_not_fit_the_current_is_told(run_scene, factor):
    (told,) = warnings(run_scene(*SHORT, MEASURED, bench=with_field(factor)))
    assert "200 mN: the teslameter reads" in told
    assert "has 10.97 mT" in told and "forces of this run are not what" in told


def test_a_dead_shunt_is_told(run_scene):
    dead = 'simulated.open_probes=["coil_current"]'
    (told,) = warnings(run_scene(*SHORT, MEASURED, dead))
    assert "the shunt shows" in told and "the source reads back 99" in told


def test_each_is_told_once(run_scene):
    twice = 'protocol.levels=["100 mN", "200 mN"]'
    ran = run_scene(*SHORT, twice, MEASURED, bench=with_field(0.5))
    assert len(warnings(ran)) == 1


def test_coil_leads_exchanged_are_told(run_scene):
    ran = run_scene(*SHORT, MEASURED, "simulated.inverted_coil=true")
    (told,) = warnings(ran)
    assert re.search("the teslameter reads [-\u2212]10.97 mT", told)


def test_a_calibrated_field_is_held_to_a_tenth(run_scene, tmp_path):
    file = tmp_path / "field.csv"
    file.write_text("current_A,field_T\n-1,-0.011\n0,0\n1,0.011\n")

    calibrated = f'bench.magnet.calibration="{file}"'
    told = warnings(run_scene(*SHORT, MEASURED, calibrated, bench=with_field(0.75)))
    assert any("where the calibration has 10.97 mT" in text for text in told)
    told = warnings(run_scene(*SHORT, MEASURED, calibrated, bench=with_field(0.95)))
    assert not any("teslameter reads" in text for text in told)


CHANGING = ('record.signals=["coil_current", "field"]', "record.sample_rate=20 kS/s")


@pytest.mark.parametrize(
    ("scene", "factor", "told"),
    [("vibration", 1.0, 0), ("vibration", -1.0, 1), ("texture", 0.25, 1)],
)
def test_the_field_of_a_force_that_changes_is_compared_by_its_mean(
    run_scene, scene, factor, told
):
    few = {
        "vibration": ("protocol.presentations_each=1", "protocol.count=2"),
        "texture": ("protocol.passes=1",),
    }
    ran = run_scene(*CHANGING, *few[scene], scene=scene, bench=with_field(factor))
    said = [text for text in warnings(ran) if "the teslameter reads" in text]
    assert len(said) == told


def test_of_a_long_trial_the_shunt_is_compared_as_far_back_as_it_is_known(
    run_scene, monkeypatch
):
    """Of 200 s the last 131 were known, and 0 A over all beside −23 mA over these."""
    monkeypatch.setattr(live, "CAPACITY", 1 << 12)
    sine = ("protocol.lowest=0.2 Hz", "protocol.highest=0.4 Hz", "protocol.count=2")
    ran = run_scene(*sine, MEASURED, scene="sine_sweep")
    assert not any("shunt" in text for text in warnings(ran))


def test_the_shunt_of_a_force_that_changes_is_compared_by_its_mean(run_scene):
    dead = 'simulated.open_probes=["coil_current"]'
    few = "protocol.passes=1"
    said = warnings(run_scene(*CHANGING, few, dead, scene="texture"))
    assert any("the shunt shows" in text for text in said)


def test_a_source_that_is_set_twice_a_second_does_not_make_the_shunt_doubtful(
    run_scene,
):
    """A straight line was laid from one of its set-points to the next: 721 mA were
    seen of what was taken for 798."""
    slow = "bench.coil.baud=1200", "bench.coil.timeout=0.7 s", "protocol.hold=2 s"
    ran = run_scene(*slow, 'protocol.levels=["160 mN"]', "record.sample_rate=50 kS/s")
    assert not any("shunt" in text for text in warnings(ran))
