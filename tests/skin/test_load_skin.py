"""A skin's file: what cannot be used is refused before anything is computed."""

import numpy as np
import pytest

from tactile_lab.errors import SceneError
from tactile_lab.skin.braille import dots
from tactile_lab.skin.skin import load_skin

BALL = {"kind": "sphere", "force": "1 N"}


def skin(array=None, stimulus=BALL, **more):
    return load_skin(
        {
            "duration": "1 s",
            "array": array or {"grid": [4, 5]},
            "stimulus": [stimulus],
            **more,
        }
    )


@pytest.mark.parametrize(
    ("array", "why"),
    [
        ({}, "no taxels: write one of grid"),
        ({"grid": [2, 2], "hexagonal": [2, 2]}, "grid and hexagonal: write one"),
        ({"grid": [2, 2], "pitch": "1 mm", "side": "2 mm"}, "taxels 0 and 1 overlap"),
        ({"hexagonal": [2, 2], "pitch": "1 mm"}, "taxels 0 and 2 overlap"),
        (
            {"positions": [["0 mm", "0 mm"], ["9 mm", "0 mm"], ["0.5 mm", "0 mm"]]},
            "taxels 0 and 2 overlap: they are 500 µm apart",
        ),
        ({"positions": [["0 m", "0 m"], ["0 m", "0 m"]]}, "overlap: they are 0 m"),
        ({"grid": [2, 2], "dead": [4]}, "numbered 0 to 3"),
        ({"grid": [2, 2], "dead": [1], "stuck": [1]}, "both dead and stuck"),
        ({"grid": [10_000, 10_000]}, "at most 10,000,000"),
        ({"grid": [2, 2], "pich": "1 mm"}, 'did you mean "pitch"'),
        ({"grid": [2, 2], "pitch": 1}, "has no unit"),
    ],
)
def test_an_array_that_cannot_be_is_refused(array, why):
    with pytest.raises(SceneError, match=why):
        skin({"x": 0} if array is None else array or {"pitch": "2 mm"})


@pytest.mark.parametrize(
    ("stimulus", "why"),
    [
        ({"kind": "spere"}, 'did you mean "sphere"'),
        ({"kind": "sphere", "force": "-1 N"}, "above 0 N"),
        ({"kind": "sphere", "times": 3}, "write a period"),
        ({"kind": "grating", "ridge": "2 mm", "spacing": "1 mm"}, "overlap"),
        ({"kind": "texture", "shortest": "9 mm", "longest": "1 mm"}, "is longer than"),
        ({"kind": "texture", "roughness": 0.9}, "at most 0.3"),
        ({"kind": "braille", "text": "ß"}, "no braille cell"),
        ({"kind": "braille", "text": "  "}, "raises no dot"),
        ({"kind": "sphere", "speed": "1 km/s", "hold": "1000 s"}, "points of force"),
        ({"kind": "frames", "file": "nowhere.npy"}, "does not exist"),
        ({"force": "1 N"}, "kind is missing: Kinds: sphere"),
    ],
)
def test_a_stimulus_that_cannot_be_is_refused(stimulus, why):
    with pytest.raises(SceneError, match=why):
        skin(stimulus=stimulus, duration="2000 s").times  # noqa: B018


def test_what_arrays_cannot_do_is_said():
    with pytest.raises(SceneError, match="tolerance"):
        skin(tolerance="1e-20 s")
    with pytest.raises(SceneError, match="stuck taxels would fire 1e"):
        skin({"grid": [2, 2], "stuck": [1], "stuck_rate": "10 kHz"}, duration="1e9 s")
    with pytest.raises(SceneError, match="start"):
        skin(sensor={"start": {"V_P": "0 V", "V_C1": "0 V", "V_C2": "0 V"}})


@pytest.mark.parametrize(
    ("made", "why"),
    [
        (np.zeros((3, 19)), "forces for 19 taxels; the array has 20"),
        (np.full((3, 20), np.nan), "taxel 0 in frame 0 is nan"),
        (np.zeros(20), "of shape"),
        (np.zeros((0, 20)), "of shape"),
        (np.array([["a"] * 20]), "of shape"),
    ],
)
def test_frames_that_do_not_fit_are_refused(tmp_path, made, why):
    np.save(tmp_path / "f.npy", made)
    with pytest.raises(SceneError, match=why):
        load_skin(
            {
                "duration": "1 s",
                "array": {"grid": [4, 5]},
                "stimulus": [{"kind": "frames", "file": "f.npy"}],
            },
            folder=tmp_path,
        )


def test_an_archive_of_frames_is_refused(tmp_path):
    np.savez(tmp_path / "f.npz", a=np.zeros((3, 20)))
    with pytest.raises(SceneError, match="is an archive"):
        skin(stimulus={"kind": "frames", "file": str(tmp_path / "f.npz")})


def test_braille_is_as_printed():
    assert dots("c").tolist() == [[0, 0, 0], [0, 1, 0]]
    # w: 2456, and a number with its sign
    assert dots("w").tolist() == [[0, 0, 1], [0, 1, 0], [0, 1, 1], [0, 1, 2]]
    assert [cell for cell, *_ in dots("10").tolist()] == [0, 0, 0, 0, 1, 2, 2, 2]


def test_rows_are_numbered_from_the_top_left_and_hexagons_lie_between():
    places = skin({"grid": [2, 3], "pitch": "2 mm"}).array.places * 1e3
    assert places.tolist() == [[-2, 1], [0, 1], [2, 1], [-2, -1], [0, -1], [2, -1]]
    hexagons = skin({"hexagonal": [3, 4], "pitch": "2 mm"}).array.places
    apart = np.linalg.norm(hexagons[:, None] - hexagons, axis=2)
    assert np.min(apart[apart > 0]) == pytest.approx(2e-3)
    assert np.sum(np.isclose(apart[5], 2e-3)) == 6
