"""How far rates fall while the load rests: where it does, and for whom that is told."""

import numpy as np
import pytest

from tactile_lab.analysis.spike_train import respond
from tactile_lab.skin import adaptation
from tactile_lab.skin.adaptation import adaptation_of, longest_hold
from tactile_lab.skin.events import Events
from tactile_lab.skin.press import press
from tactile_lab.skin.skin import load_skin

BALL = {"kind": "sphere", "force": "4 N", "radius": "8 mm", "start": "0.1 s"}
SKIN = {
    "duration": "3 s",
    "array": {"grid": [9, 9], "pitch": "1 mm", "dead": [3], "stuck": [12]},
    "stimulus": [
        {**BALL, "hold": "2 s"},
        {**BALL, "at": ["4 mm", "4 mm"], "start": "2.4 s", "hold": "0.4 s"},
    ],
}


def hold_of(*stimuli, duration="3 s"):
    """The longest hold of these stimuli on a small skin."""
    return longest_hold(
        load_skin({**SKIN, "duration": duration, "stimulus": list(stimuli)})
    )


@pytest.mark.parametrize(
    "stimuli, hold",
    [
        ([{**BALL, "hold": "2 s"}], (0.15, 2.15)),
        ([{**BALL, "hold": "9 s"}], (0.15, 3.0)),
        ([{**BALL, "hold": "2 s", "vibration": 0.1}], None),
        ([{**BALL, "hold": "2 s", "speed": "5 mm/s"}], None),
        ([{**BALL, "hold": "2 s", "speed": "5 mm/s", "rests": "1 s"}], (0.15, 1.1)),
        # of equal presses the first, though the pauses between them are longer
        ([{**BALL, "hold": "0.2 s", "times": 3, "period": "1 s"}], (0.15, 0.35)),
        # another load that comes and goes disturbs the rest
        (
            [{**BALL, "hold": "2 s"}, {**BALL, "start": "0.5 s", "hold": "1 s"}],
            (0.55, 1.55),
        ),
        ([{**BALL, "start": "3.5 s"}], None),
    ],
)
def test_the_hold_is_the_longest_time_in_which_the_load_rests(stimuli, hold):
    assert hold_of(*stimuli) == (None if hold is None else pytest.approx(hold))


def test_forces_from_a_file_rest_before_the_first_frame_and_after_the_last(tmp_path):
    np.save(tmp_path / "f.npy", np.array([[0.0, 0.1], [0.0, 0.2], [0.0, 0.2]]))
    skin = {
        "duration": "3 s",
        "array": {"grid": [1, 2]},
        "stimulus": [{"kind": "frames", "file": "f.npy", "rate": "1 S/s"}],
    }
    assert longest_hold(load_skin(skin, folder=tmp_path)) == (2.0, 3.0)
    np.save(tmp_path / "f.npy", np.array([[0.0, 0.1], [0.0, 0.2], [0.0, 0.0]]))
    assert longest_hold(load_skin(skin, folder=tmp_path)) is None


@pytest.fixture(scope="module")
def pressed(tmp_path_factory):
    folder = tmp_path_factory.mktemp("hold")
    skin = load_skin(SKIN)
    press(skin, folder)
    return skin, Events.read(folder)


@pytest.mark.parametrize("read", [1 << 22, 7])
def test_the_fall_is_that_of_a_single_trial(pressed, monkeypatch, read):
    monkeypatch.setattr(adaptation, "READ", read)
    skin, events = pressed
    found = adaptation_of(skin, events)
    assert found.known.sum() > 5 and found.rare.any()
    for taxel, train in enumerate(events.trains()):
        alone = respond(train, hold=found.hold)
        assert found.intervals[taxel] == alone.intervals
        if taxel == 12 or alone.intervals < 2:
            assert np.isnan(found.fall[taxel]) and not found.silent[taxel]
            assert found.rare[taxel] == (taxel != 12 and train.size > 0)
        else:
            assert found.fall[taxel] == pytest.approx(alone.fall, abs=1e-12)
            assert found.silent[taxel] == (alone.silent is not None)
            assert 0 < found.fall[taxel] < 1 and found.error[taxel] < 1e-6


def test_its_words_and_numbers_agree(pressed):
    found = adaptation_of(*pressed)
    told = found.to_dict()
    assert f"falls by {100 * told['fall_median']:.0f} % (median" in found.told
    assert f"in {told['taxels']} taxels from 150 ms to 2.15 s" in found.told
    assert told["too_few_spikes"] == found.rare.sum()


def test_spikes_moved_by_their_error_stay_within_the_error_that_is_told(pressed):
    skin, events = pressed
    found = adaptation_of(skin, events)
    taxel = int(np.nanargmax(found.fall))
    train = events.train(taxel)
    train = train[(train >= found.hold[0]) & (train <= found.hold[1])]
    most = float(events.about["error_s"])
    signs = np.random.default_rng(1).choice([-1.0, 1.0], (200, train.size))
    isi = np.diff(train + most * signs, axis=1)
    moved = 1 - isi.min(axis=1) / isi[:, -1]
    assert np.abs(moved - found.fall[taxel]).max() <= 1.001 * found.error[taxel] + 1e-14
