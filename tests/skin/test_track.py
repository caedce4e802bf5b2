"""Series along a track against the stress they stand for, and who shares them."""

import numpy as np
import pytest
from numba import njit

from tactile_lab.skin import contact
from tactile_lab.skin.events import Events
from tactile_lab.skin.forces import Loads
from tactile_lab.skin.press import press
from tactile_lab.skin.single import simulate_taxel
from tactile_lab.skin.skin import load_skin

SLIDING = {
    "grating": {"kind": "grating", "pressure": "100 kPa", "angle": "20 deg"},
    "texture": {"kind": "texture", "pressure": "80 kPa"},
    "braille": {"kind": "braille", "text": "tau", "force": "0.4 N"},
}


@njit
def stress(load, x, y, depth):
    return contact.stress(load, 1.0, x, y, depth)


def slide(kind, towards="0 deg", grid=(2, 12), **more):
    return load_skin(
        {
            "duration": "0.6 s",
            "sensor": {"preset": "fig5b"},
            "array": {"grid": list(grid)},
            "stimulus": [
                {
                    **SLIDING[kind], "speed": "40 mm/s", "towards": towards,
                    "ramp": "20 ms", "hold": "0.5 s", "at": ["-6 mm", "0 mm"], **more,
                }
            ],
        }
    )  # fmt: skip


@pytest.mark.parametrize("towards", ["0 deg", "90 deg", "200 deg"])
@pytest.mark.parametrize("kind", SLIDING)
def test_a_sliding_load_presses_as_its_closed_forms_say(kind, towards):
    skin = slide(kind, towards)
    one, area = skin.stimuli[0], skin.array.side**2
    way = np.radians(one.towards)
    loads = Loads(skin)
    for taxel in (0, 7, 20):
        time, _ = loads.force(taxel)
        x, y = skin.array.places[taxel] - one.at
        for t in np.linspace(0.03, 0.5, 37):
            moved = one.speed * t
            u, v = x - moved * np.cos(way), y - moved * np.sin(way)
            told = sum(
                stress(load, u, v, skin.array.depth) for load in one.loads(skin.array)
            )
            exact = area * one.strength * told
            found = np.interp(t, time, loads.force(taxel)[1])
            assert found == pytest.approx(exact, abs=1.01 * skin.force_error)


@pytest.mark.parametrize("towards", ["0 deg", "90 deg", "37 deg"])
@pytest.mark.parametrize("kind", SLIDING)
def test_a_taxel_under_a_sliding_load_is_what_it_is_alone(kind, towards, tmp_path):
    skin = slide(kind, towards)
    done = press(skin, tmp_path, cores=2)
    assert done.events > 0
    events = Events.read(tmp_path)
    for taxel in range(skin.array.size):
        alone = simulate_taxel(skin, taxel).spike_times
        assert np.array_equal(events.train(taxel), alone), taxel


def test_taxels_of_a_row_share_what_is_computed_along_it():
    skin = slide("texture", grid=(1, 40))
    loads = Loads(skin)
    loads.force(0)
    first = np.isfinite(loads.pressing.series.key[:, 2]).sum()
    for taxel in range(1, 40):
        loads.force(taxel)
    row = np.isfinite(loads.pressing.series.key[:, 2]).sum()
    length = np.ptp(skin.array.places[:, 0]) / skin.array.depth
    assert 0 < row <= first + length + 2
