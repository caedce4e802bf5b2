"""The catalogue lists what is there, and its index is never trusted too far."""

import json
from datetime import date, timedelta

import pytest

from tactile_lab.errors import RunFolderError
from tactile_lab.store.catalogue import INDEX, catalogue
from tactile_lab.store.folder import RunFolder, read_info, write_json


@pytest.fixture
def root(tmp_path):
    for protocol, sensor in (("pulses", "S12"), ("hold", "S12"), ("pulses", "S7")):
        folder = RunFolder.create(
            tmp_path, protocol, {"protocol": protocol, "notes": {"sensor": sensor}}
        )
        folder.finish("complete", spikes_online=3)
    (tmp_path / "something else").mkdir()
    return tmp_path


def test_filters(root):
    assert len(catalogue(root)) == 3
    assert [e.sensor for e in catalogue(root, protocol="pulses")] == ["S12", "S7"]
    assert len(catalogue(root, sensor="s12")) == 2
    today = date.today()
    assert len(catalogue(root, since=today - timedelta(1), until=today)) == 3
    assert catalogue(root, since=today + timedelta(1)) == []
    assert catalogue(root, until=today - timedelta(2)) == []


def test_index_follows_what_changes(root):
    catalogue(root)
    entry = catalogue(root, sensor="S7")[0]
    path = root / entry.name
    write_json(path / "run.json", {**read_info(path), "spikes_online": 1234})
    assert catalogue(root, sensor="S7")[0].spikes == 1234


@pytest.mark.parametrize("rubbish", ["", "{", "[]", '{"version": 2, "runs": 5}'])
def test_a_broken_index_is_rebuilt(root, rubbish):
    catalogue(root)
    (root / INDEX).write_text(rubbish)
    assert len(catalogue(root)) == 3
    assert json.loads((root / INDEX).read_text())["runs"]


def test_a_run_that_cannot_be_read_is_listed_as_such(root):
    (root / "broken").mkdir()
    (root / "broken" / "run.json").write_text("{")
    broken = [entry for entry in catalogue(root) if entry.trouble]
    assert [entry.name for entry in broken] == ["broken"]


def test_running_and_cut_short_are_told_apart(tmp_path):
    folder = RunFolder.create(tmp_path, "pulses", {})
    assert catalogue(tmp_path)[0].status == "running"
    folder._log.close()  # what the kernel does when the process dies
    assert catalogue(tmp_path)[0].status == "cut short"


def test_a_folder_that_is_none_is_refused(tmp_path):
    with pytest.raises(RunFolderError, match="cannot be listed"):
        catalogue(tmp_path / "nowhere")
