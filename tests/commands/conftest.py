"""A command line run in this process, with what it printed."""

import json
from dataclasses import dataclass

import pytest

from tactile_lab.cli import main


@dataclass(frozen=True)
class Answer:
    code: int
    out: str
    err: str

    @property
    def json(self):
        def no_constant(name):
            raise AssertionError(f"{name} is not JSON")

        return json.loads(self.out, parse_constant=no_constant)


@pytest.fixture
def tactile_lab(capsys):
    def run(*arguments) -> Answer:
        with pytest.raises(SystemExit) as end:
            main([str(argument) for argument in arguments])
        printed = capsys.readouterr()
        return Answer(end.value.code, printed.out, printed.err)

    return run


@pytest.fixture
def scene_file(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)

    def write(text, name="scene.toml"):
        path = tmp_path / name
        if isinstance(text, bytes):
            path.write_bytes(text)
        else:
            path.write_text(text, encoding="utf-8")
        return path

    return write
