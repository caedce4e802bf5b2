"""The protocol's generator is driven as a run will drive it."""

from pathlib import Path

import numpy as np
import pytest

from tactile_lab.errors import LimitError, SceneError
from tactile_lab.model import kernel
from tactile_lab.planning.timeline import timeline
from tactile_lab.scene.load import load

HEAD = """
from typing import ClassVar
from tactile_lab.trial import Protocol, Trial
from tactile_lab.waveform import Waveform

class Mine(Protocol):
    name: ClassVar[str] = "mine"
    title: ClassVar[str] = "Mine"
"""


@pytest.fixture
def protocol(tmp_path):
    def make(body: str, *overrides: str):
        path = tmp_path / "mine.py"
        path.write_text(HEAD + body)
        return load(Path(path), overrides)

    return make


def test_trials_follow_one_another():
    drive = timeline(load(), through_coil=False)
    assert [step.start for step in drive.steps] == [0.0, 4.5, 9.0, 13.5]
    assert drive.duration == drive.streamed == 18.0
    assert drive.force.at([1.0, 5.5, 10.0, 14.5, 4.0]) == pytest.approx(
        [0.08, 0.12, 0.16, 0.2, 0.0]
    )
    assert drive.current is None


def test_through_the_coil_the_current_gives_the_force():
    scene = load()
    drive = timeline(scene, through_coil=True)
    assert drive.warnings == ()
    assert drive.current is not None
    per_ampere = scene.bench.magnet.newtons_per_ampere
    assert drive.current.peak * per_ampere == pytest.approx(0.2)


def test_ideal_steps_are_kept_and_coil_steps_are_limited():
    scene = load(None, ["protocol.ramp=0 s"])
    assert np.isinf(timeline(scene, through_coil=False).force.steepest)
    drive = timeline(scene, through_coil=True)
    assert "a jump asked" in drive.warnings[0]
    assert drive.current.steepest <= 5.0 + 1e-6


def test_strict_refuses_what_would_be_limited():
    scene = load(None, ["protocol.ramp=10 ms", "coil.strict=true"])
    with pytest.raises(SceneError, match=r"coil\.strict"):
        timeline(scene, through_coil=True)
    timeline(scene, through_coil=False)


def test_force_beyond_the_coil_names_the_reachable_force():
    scene = load(None, ['protocol.levels=["500 mN"]'])
    with pytest.raises(LimitError, match=r"reachable is −401\.2 mN to 401\.2 mN"):
        timeline(scene, through_coil=True)
    assert timeline(scene, through_coil=False).force.peak == 0.5


def test_a_current_that_the_compliance_does_not_drive_through_the_coil_is_refused():
    given = ['bench.coil.limits.resistance="20 Ohm"', 'protocol.levels=["160 mN"]']
    with pytest.raises(LimitError, match=r"20 Ohm need 15\.95 V.*is 14 V"):
        timeline(load(None, given), through_coil=True)
    given[1] = 'protocol.levels=["130 mN"]'
    assert timeline(load(None, given), through_coil=True).current is not None


def test_a_hold_that_overheats_the_coil_is_refused_before_anything_opens():
    scene = load(None, ['protocol.levels=["200 mN"]', "protocol.hold=60 s"])
    with pytest.raises(LimitError, match="heat budget of 30"):
        timeline(scene, through_coil=True)


def test_an_adaptive_protocol_gets_the_models_answer(protocol):
    scene = protocol(
        "    def trials(self):\n"
        "        level = 0.05\n"
        "        while level < 0.2:\n"
        "            outcome = yield Trial(force=Waveform.pulse(level, ramp=0.25, "
        'hold=1, rest=20), label=f"{level:g} N", level=level)\n'
        "            if outcome.spike_times.size:\n"
        "                return\n"
        "            level += 0.01\n"
    )
    drive = timeline(scene, through_coil=True)
    assert 0.09 <= drive.steps[-1].trial.level <= 0.12
    assert len(drive.steps) > 3


def test_each_press_is_solved_once_however_many_there_are(monkeypatch):
    solved = 0.0

    def counted(time, force, until, k_F, par, memory, *rest):
        nonlocal solved
        solved += until - memory[kernel.TIME]
        return run(time, force, until, k_F, par, memory, *rest)

    run = kernel.run
    monkeypatch.setattr(kernel, "run", counted)
    scene = load("threshold_drift", {"protocol.presses": 12})
    drive = timeline(scene, through_coil=True)
    assert drive.duration / 2 < solved <= drive.duration


def test_spikes_that_are_looked_at_must_be_asked_for(protocol):
    body = (
        "    def trials(self):\n"
        "        outcome = yield Trial(force=Waveform.pulse(0.1, ramp=0.2, hold=1), "
        'label="x")\n'
        "        outcome.spike_times\n"
    )
    scene = protocol(body, 'record.signals=["V_C1"]')
    with pytest.raises(SceneError, match="looks at spikes"):
        timeline(scene, through_coil=False)
    declared = protocol(
        '    needs: ClassVar[tuple[str, ...]] = ("spikes",)\n' + body,
        'record.signals=["V_C1"]',
    )
    timeline(declared, through_coil=False)


def test_rest_and_traces_come_from_the_model(protocol, tmp_path):
    scene = protocol(
        "    def trials(self):\n"
        "        outcome = yield Trial(force=Waveform.pulse(0.1, ramp=0.2, hold=1), "
        'label="x")\n'
        '        assert abs(outcome.rest["V_C1"] - 4.347) < 1e-3\n'
        '        trace = outcome.traces["V_C1"]\n'
        "        assert trace.shape[1] == 2 and trace[:, 1].min() < 4.1\n"
        "        assert outcome.current.shape[1] == 2\n"
    )
    timeline(scene, through_coil=True)


@pytest.mark.parametrize(
    ("body", "told"),
    [
        ("    def trials(self):\n        yield from ()\n", "no trial"),
        (
            "    def trials(self):\n        raise KeyError('x')\n        yield\n",
            "KeyError",
        ),
        (
            "    def trials(self):\n        while True:\n"
            "            yield Trial(force=Waveform.constant(0.0), duration=1.0, "
            'label="x")\n',
            "more than",
        ),
        (
            "    def trials(self):\n"
            '        yield Trial(force=Waveform.constant(0.0), label="x")\n',
            "must be longer",
        ),
        (
            "    def trials(self):\n"
            '        yield Trial(force=Waveform.constant(float("nan")), label="x")\n',
            "finite",
        ),
        (
            "    def trials(self):\n        yield Trial(force=Waveform.constant(0.0), "
            'duration=1.0, hold=(0.5, 2.0), label="x")\n',
            "a part of its trial",
        ),
        (
            "    def trials(self):\n        yield Trial(force=Waveform.constant(0.0), "
            'duration=1.0, label="x")\n        yield None\n',
            "trials gave NoneType; yield a Trial",
        ),
        (
            "    def trials(self):\n        raise GeneratorExit\n        yield\n",
            "GeneratorExit",
        ),
    ],
)
def test_a_faulty_protocol_is_refused_in_words(protocol, body, told, monkeypatch):
    monkeypatch.setattr("tactile_lab.planning.timeline.MOST_TRIALS", 200)
    with pytest.raises(SceneError, match=told):
        timeline(protocol(body), through_coil=True)


def test_pauses_count_as_time_but_not_as_samples(protocol):
    scene = protocol(
        "    def trials(self):\n"
        "        yield Trial(force=Waveform.pulse(0.1, ramp=0.2, hold=1, rest=0.6), "
        'label="x")\n'
        "        yield Trial(force=Waveform.constant(0.0), duration=50.0, "
        'label="recovery", pause=True)\n'
    )
    drive = timeline(scene, through_coil=True)
    assert (drive.duration, drive.streamed) == (52.0, 2.0)


def test_a_trial_given_as_current_is_turned_into_force(protocol):
    scene = protocol(
        "    def trials(self):\n"
        "        yield Trial(force=Waveform.constant(0.0), "
        "current=Waveform.pulse({}, ramp=1.0, hold=1.0), label='x')\n".format("0.5")
    )
    per_ampere = scene.bench.magnet.newtons_per_ampere
    for through in (False, True):
        drive = timeline(scene, through_coil=through)
        assert drive.force.peak == pytest.approx(0.5 * per_ampere)
