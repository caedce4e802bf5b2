"""The `waveform` protocol: any force from a CSV beside the scene."""

import numpy as np
import pytest

from tactile_lab.errors import SceneError
from tactile_lab.planning.timeline import timeline
from tactile_lab.scene.load import load


@pytest.fixture
def scene_with(tmp_path):
    def make(csv: str, more: str = ""):
        (tmp_path / "force.csv").write_text(csv)
        path = tmp_path / "s.toml"
        path.write_text(f'[protocol]\nname = "waveform"\nfile = "force.csv"\n{more}')
        return load(path)

    return make


def force(scene):
    drive = timeline(scene, through_coil=False)
    return drive.force, drive.duration


def test_linear_between_rows_and_held_outside(scene_with):
    wave, duration = force(
        scene_with("time_s,force_N\n1,0.1\n2,0.2\n", 'duration = "4 s"\n')
    )
    assert duration == 4.0
    at = wave.at([0.0, 0.5, 1.0, 1.5, 2.0, 3.0, 4.0])
    assert at == pytest.approx([0.1, 0.1, 0.1, 0.15, 0.2, 0.2, 0.2])


def test_the_last_time_is_the_default_duration(scene_with):
    assert force(scene_with("time_s,force_N\n0,0\n2.5,0.2\n"))[1] == 2.5


def test_the_same_time_twice_is_a_jump_also_at_both_ends(scene_with):
    wave, _ = force(scene_with("time_s,force_N\n0,0\n0,0.1\n1,0.1\n1,0\n2,0\n2,0.05\n"))
    assert wave.at([0.0, 0.5, 1.0, 1.5, 2.0]) == pytest.approx([0.1, 0.1, 0, 0, 0.05])
    assert wave.value[0] == 0.0, "the jump at 0 is a jump, not a first value"
    assert np.isinf(wave.steepest)


def test_a_first_value_other_than_zero_is_no_jump(scene_with):
    wave, _ = force(scene_with("time_s,force_N\n0,0.1\n1,0.1\n"))
    assert wave.steepest == 0.0


def test_duration_cuts_a_longer_table(scene_with):
    wave, duration = force(
        scene_with("time_s,force_N\n0,0\n2,0.2\n", 'duration = "1 s"\n')
    )
    assert (duration, wave.end) == (1.0, 1.0)
    assert wave.at(1.0) == pytest.approx(0.1)


def test_spaces_comments_blank_lines_and_windows_files_are_fine(scene_with):
    wave, _ = force(
        scene_with("\ufefftime_s, force_N\r\n# a note\r\n\r\n 0, 0\r\n1, 1e-1\r\n")
    )
    assert wave.at(1.0) == pytest.approx(0.1)


@pytest.mark.parametrize(
    ("csv", "told"),
    [
        ("time_s,force_N\n1,0\n0,0\n", "line 3.*sort"),
        ("time_s,force_N\n0,0\n1,nan\n", "line 3.*force_N is nan"),
        ("time_s,force_N\n0,0\n1,-inf\n", "line 3.*-inf"),
        ("time_s,force_N\n0,0\n1,1e999\n", "line 3.*1e999"),
        ("time_s,force_N\n0,0\n0,1\n0,2\n", "line 4.*third"),
        ("time_s,force_N\n0,0,0\n", "line 2.*3 values"),
        ("time_s,force_N\n0,a\n", "line 2.*not a number"),
        ("t,F\n0,0\n", "line 1.*time_s,force_N"),
        ("time_s,force_N\n", "no rows"),
        ("", "empty"),
        ("time_s,force_N\n0,0.1\n", "duration"),
        ("time_s,force_N\n-1,0\n", "duration"),
    ],
)
def test_a_bad_table_is_refused_with_the_line(scene_with, csv, told):
    with pytest.raises(SceneError, match=f"(?s)force.csv.*{told}"):
        scene_with(csv)


def test_missing_file_folder_and_binary(tmp_path, scene_with):
    path = tmp_path / "s.toml"
    for name, told in (("nope.csv", "does not exist"), (".", "is a folder")):
        path.write_text(f'[protocol]\nname = "waveform"\nfile = "{name}"\n')
        with pytest.raises(SceneError, match=told):
            load(path)
    (tmp_path / "b.csv").write_bytes(bytes(range(256)))
    path.write_text('[protocol]\nname = "waveform"\nfile = "b.csv"\n')
    with pytest.raises(SceneError, match="not text"):
        load(path)
