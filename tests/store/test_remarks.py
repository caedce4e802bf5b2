"""Name, tags and notes of a run, and how they are found again."""

import json
import subprocess
import sys

import pytest
from click.testing import CliRunner

from tactile_lab.cli import cli
from tactile_lab.errors import RunFolderError
from tactile_lab.store.catalogue import Catalogue
from tactile_lab.store.folder import RunFolder
from tactile_lab.store.remarks import (
    REMARKS,
    Note,
    Remarks,
    add_note,
    read_remarks,
    write_remarks,
)


def _runs(root, **asked):
    with Catalogue(root) as found:
        return found.runs(**asked)


@pytest.fixture
def run(tmp_path):
    folder = RunFolder.create(tmp_path, "pulses", {"title": "Pulses", "notes": {}})
    folder.finish("complete")
    return folder.path


def test_notes_stand_in_order_of_their_time(run):
    add_note(run, "late", 9.0)
    add_note(run, "early", 2.0)
    add_note(run, "on the whole")
    said = read_remarks(run).notes
    assert [note.text for note in said] == ["on the whole", "early", "late"]
    assert str(said[1]) == "2.0 s: early"


def test_remarks_are_changed_and_read_back_the_same(run):
    said = Remarks(title="best", tags=["a", "b"], starred=True, notes=[Note(text="x")])
    write_remarks(run, said)
    assert read_remarks(run).notes[0] == said.notes[0]
    assert read_remarks(run).title == "best" and read_remarks(run).starred


def test_the_catalogue_follows_remarks_and_searches_them(run):
    assert _runs(run.parent, words="moved magnet") == []
    add_note(run, "moved the MAGNET", 1.5)
    (found,) = _runs(run.parent, words="moved magnet")
    assert found.notes == ["1.5 s: moved the MAGNET"]
    write_remarks(run, Remarks(title="best", tags=["paper"]))
    (found,) = _runs(run.parent, words="paper")
    assert found.title == "best" and found.tags == ["paper"]


def test_notes_of_older_runs_are_read_from_their_log(run):
    line = {
        "at": "2026-11-01T10:00:00+00:00",
        "kind": "note",
        "text": "old",
        "time_s": 3,
    }
    with (run / "log.jsonl").open("a") as log:
        log.write(json.dumps(line) + "\n" + '{"cut sho')
    assert [str(note) for note in read_remarks(run).notes] == ["3.0 s: old"]


@pytest.mark.parametrize("rubbish", ["{", "[]", '{"notes": [{"txt": 1}]}', '{"a": 1}'])
def test_damaged_remarks_are_refused_with_what_to_do(run, rubbish):
    (run / REMARKS).write_text(rubbish)
    with pytest.raises(RunFolderError, match="delete it"):
        read_remarks(run)
    (entry,) = _runs(run.parent)
    assert "remarks" in entry.trouble


def _noted(run, *words):
    return CliRunner().invoke(cli, ["note", str(run), *words])


def test_notes_tags_and_stars_from_the_command_line_are_found(run):
    done = _noted(run, "moved it", "--at", "1500 ms", "--tag", "cal", "--tag", "#new",
                  "--star")  # fmt: skip
    assert done.exit_code == 0, done.output
    assert "1.5 s: moved it" in done.output
    for where in ("tag = cal", "tag = new and starred = yes", "note ~ MOVED"):
        assert len(_runs(run.parent, where=where)) == 1
    assert _noted(run, "--untag", "new", "--no-star").exit_code == 0
    kept = read_remarks(run)
    assert (kept.tags, kept.starred) == (["cal"], False)
    told = json.loads(_noted(run, "--json").stdout)
    assert told["notes"][0]["time_s"] == 1.5


@pytest.mark.parametrize(
    ("words", "why"),
    [
        (["--tag", "two words"], "is no tag"),
        (["--untag", "gone"], "has no tag gone"),
        (["--at", "1 s"], "write the note"),
        (["  "], "is empty"),
        (["when", "--at", "1 N"], "s is needed"),
    ],
)
def test_a_remark_that_is_none_is_refused_and_nothing_written(run, words, why):
    done = _noted(run, *words)
    assert done.exit_code == 2 and why in done.output
    assert not (run / REMARKS).exists()


def test_notes_of_many_hands_at_once_are_all_kept(run):
    """Two `tactile-lab note` at once read the same file, and the later one won."""
    code = (
        "import sys; from pathlib import Path;"
        "from tactile_lab.store.remarks import add_note;"
        "[add_note(Path(sys.argv[1]), f'{sys.argv[2]} {k}') for k in range(20)]"
    )
    hands = [
        subprocess.Popen([sys.executable, "-c", code, str(run), name])
        for name in ("one", "other", "third")
    ]
    assert [hand.wait() for hand in hands] == [0, 0, 0]
    assert len(read_remarks(run).notes) == 60
