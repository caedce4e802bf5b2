"""Who is left out without computing its force: surely silent, and cheap."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tactile_lab.model.batch import critical_forces, records
from tactile_lab.model.specimen import parts
from tactile_lab.skin import blocks, kernel
from tactile_lab.skin.bound import least_critical, spans
from tactile_lab.skin.events import Events
from tactile_lab.skin.forces import Loads
from tactile_lab.skin.press import press
from tactile_lab.skin.single import force_of, simulate_taxel
from tactile_lab.skin.skin import load_skin

LOADS = {
    "sphere": {"kind": "sphere", "radius": "3 mm"},
    "punch": {"kind": "punch"},
    "braille": {"kind": "braille", "text": "ab"},
    "grating": {"kind": "grating", "angle": "30 deg", "ridges": 4},
    "texture": {"kind": "texture", "roughness": 0.3},
}


def bounds(skin):
    """Who surely is silent, and the largest force on each, N."""
    span, high = spans(skin, Loads(skin))
    return span < least_critical(skin), high


def skin_of(kind, strength, sensor="table1", **more):
    pressed = "pressure" if kind in ("grating", "texture") else "force"
    return load_skin(
        {
            "duration": "0.4 s",
            "sensor": {"preset": sensor},
            "array": {"grid": [3, 5], "spread": more.pop("spread", True)},
            "stimulus": [
                {
                    **LOADS[kind], pressed: strength, "ramp": "10 ms", "hold": "0.3 s",
                    **more,
                }
            ],
        }
    )  # fmt: skip


@settings(max_examples=20)
@given(
    kind=st.sampled_from(sorted(LOADS)),
    strong=st.floats(0.02, 2.0),
    speed=st.sampled_from([0.0, 5.0, 40.0]),
    towards=st.floats(0, 360),
    rests=st.sampled_from(["0 s", "0.1 s"]),
    vibration=st.sampled_from([0.0, 0.5]),
)
def test_no_force_exceeds_its_bound(kind, strong, speed, towards, rests, vibration):
    unit = f"{100 * strong} kPa" if kind in ("grating", "texture") else f"{strong} N"
    skin = skin_of(
        kind, unit, speed=f"{speed} mm/s", towards=f"{towards} deg", rests=rests,
        vibration=vibration,
    )  # fmt: skip
    out, high = bounds(skin)
    for taxel in range(skin.array.size):
        force = force_of(skin, taxel).value
        assert force.max() <= high[taxel] * (1 + 1e-6) + skin.force_error
        if out[taxel]:
            assert simulate_taxel(skin, taxel).spike_times.size == 0


def test_close_to_threshold_only_who_cannot_fire_is_left_out():
    skin = skin_of("punch", "1 N", spread=False)
    most = bounds(skin)[1].max()
    critical = critical_forces(skin.circuit, records(skin.circuit, {}))[0]
    assert least_critical(skin) == pytest.approx(critical, rel=1e-5)
    below, above = (f"{part * critical / most} N" for part in (0.9995, 1.0005))
    assert bounds(skin_of("punch", below, spread=False))[0].all()
    near = skin_of("punch", above, spread=False)
    assert not bounds(near)[0].all()
    firing = skin_of("punch", f"{1.6 * critical / most} N", spread=False)
    assert simulate_taxel(firing, 7).spike_times.size > 0


def test_no_specimen_needs_less_than_the_least_critical_force():
    skin = skin_of("punch", "1 N")
    drawn = records(skin.circuit, parts(skin.circuit, range(1, 3001)))
    found = critical_forces(skin.circuit, drawn)
    assert 0.2 * found.min() < least_critical(skin) < found.min()


def test_where_nothing_is_known_nobody_is_left_out():
    for sensor in (
        {"V_GS": "1.7 V"},  # fires at rest
        {"saturation": True},
        {"preset": "fig5b"},  # a specimen may
    ):
        skin = skin_of("punch", "1 nN")
        skin = load_skin({**skin.source, "sensor": sensor})
        assert least_critical(skin) == 0 and not bounds(skin)[0].any()


def test_forces_of_a_file_count_by_their_range(tmp_path):
    frames = np.full((3, 15), 0.02)
    frames[1, 4] = -0.5  # a fall, and the rise from it
    np.save(tmp_path / "f.npy", frames)
    data = skin_of("punch", "1 nN").source
    file = {"kind": "frames", "file": "f.npy", "rate": "10 S/s"}
    skin = load_skin({**data, "stimulus": [file]}, folder=tmp_path)
    out, _ = bounds(skin)
    assert not out[4] and out.sum() == 14


@pytest.mark.parametrize("preset", ["table1", "fig5b"])
def test_a_taxel_left_out_is_told_with_its_bound(preset, tmp_path, monkeypatch):
    drawn = []

    def noted(circuit, numbers):
        drawn.extend(numbers)
        return parts(circuit, numbers)

    monkeypatch.setattr(blocks, "parts", noted)
    skin = skin_of("sphere", "0.3 N", preset, at=["4 mm", "2 mm"])
    done = press(skin, tmp_path)
    events = Events.read(tmp_path)
    out = events.role == kernel.UNTOUCHED
    assert done.taxels["left out"] == out.sum() > 0
    assert (len(set(drawn)) == skin.array.size) == (preset == "fig5b")
    for taxel in range(skin.array.size):
        force = force_of(skin, taxel).value.max()
        bound = events.largest_force[taxel]
        assert force <= bound * (1 + 1e-6) + skin.force_error
        assert out[taxel] or bound == pytest.approx(force, abs=skin.force_error)
