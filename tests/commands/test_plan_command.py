"""``tactile-lab plan``: both lists, JSON, and a preview only where asked for."""

import pytest
from matplotlib.image import imread

KEYS = {
    "scene",
    "protocol",
    "bench",
    "needs",
    "leaves_out",
    "channels",
    "stored",
    "duration_s",
    "streamed_s",
    "trials",
    "samples",
    "disk_bytes",
    "peak_force_N",
    "peak_current_A",
    "heat_A2s",
    "coil_update",
    "ways",
    "ways_instead",
    "computing",
    "savings",
    "suggestions",
    "resolution",
    "carried_over",
    "preview",
    "assumptions",
    "warnings",
    "figure",
}


def test_it_writes_nothing_unless_asked(tactile_lab, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    answer = tactile_lab("plan")
    assert answer.code == 0
    assert "needs" in answer.out
    assert "leaves out" in answer.out
    assert "set-points" in answer.out
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("scene", ["demo", "spikes_only", "v_c1_only"])
def test_json_has_all_documented_keys(tactile_lab, scene):
    answer = tactile_lab("plan", scene, "--json")
    assert answer.code == 0
    assert set(answer.json) == KEYS
    assert answer.json["figure"] is None


@pytest.mark.parametrize("scene", ["demo", "spikes_only", "v_c1_only"])
def test_the_preview_is_drawn(tactile_lab, tmp_path, scene):
    path = tmp_path / "plan.png"
    answer = tactile_lab("plan", scene, "--preview", path, "--json")
    assert answer.json["figure"] == str(path)
    picture = imread(path)
    assert picture.shape[1] > 1000
    assert picture.std() > 0.05, "an empty sheet"


@pytest.mark.parametrize("name", ["plan.xyz", "no/such/plan.png", "folder.png"])
def test_a_preview_that_cannot_be_written_is_refused(tactile_lab, tmp_path, name):
    (tmp_path / "folder.png").mkdir()
    answer = tactile_lab("plan", "--preview", tmp_path / name)
    assert (answer.code, answer.out) == (2, "")
    assert "--preview" in answer.err


def test_warnings_go_to_stderr(tactile_lab):
    answer = tactile_lab("plan", "--set", "record.sample_rate=0.2 MS/s", "--json")
    assert "misses about 44 %" in answer.err
    assert any("misses about 44 %" in text for text in answer.json["warnings"])


def test_the_keys_of_a_scene_are_listed_with_their_meaning(tactile_lab):
    said = tactile_lab("plan", "hold_10s", "--keys").out
    assert '= "150 mN"  # Force held' in said
    assert said.startswith("protocol.level ")
    assert "record.sample_rate" in said
    for key in tactile_lab("plan", "--keys", "--json").json["keys"]:
        if key["name"] == "protocol.hold":
            assert key["value"] == '"2 s"'


def test_no_heading_stands_empty(tactile_lab):
    lines = tactile_lab("plan", "--set", 'record.signals=["force"]').out.splitlines()
    for above, below in zip(lines, [*lines[1:], ""], strict=True):
        if above and not above.startswith(" ") and ":" not in above:
            assert below.startswith("  "), above
