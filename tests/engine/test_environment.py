"""A run notes the commit it was made with."""

import subprocess

import pytest

from tactile_lab.engine.provenance import commit_of


@pytest.fixture
def checkout(tmp_path):
    (tmp_path / "file").write_text("one")
    person = ("-c", "user.name=A", "-c", "user.email=a@b")
    for arguments in (("init", "-q"), ("add", "file"), (*person, "commit", "-qm", "x")):
        subprocess.run(["git", "-C", tmp_path, *arguments], check=True)
    return tmp_path


def test_changed_files_show_as_a_plus(checkout):
    clean = commit_of(checkout)
    assert clean and not clean.endswith("+")
    (checkout / "file").write_text("other")
    assert commit_of(checkout) == clean + "+"
    assert commit_of(checkout / "nowhere") is None


def test_the_index_is_left_alone(checkout):
    index = checkout / ".git" / "index"
    (checkout / "file").touch()  # its entry is out of date: git would write it anew
    before = index.stat().st_mtime_ns
    commit_of(checkout)
    assert index.stat().st_mtime_ns == before
