"""constraints.txt: one version of each package that a run and the window need."""

import re
import tomllib
from pathlib import Path

from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

ROOT = Path(__file__).parents[1]


def test_every_dependency_has_one_version_that_the_project_takes() -> None:
    lines = (ROOT / "constraints.txt").read_text().splitlines()
    pins = [line for line in lines if not line.startswith("#")]
    # no addresses: they hold nowhere but where the file was written
    assert all(re.fullmatch(r"[a-z0-9-]+==[0-9a-z.]+", one) for one in pins), pins
    held = dict(one.split("==") for one in pins)
    assert len(held) == len(pins) and list(held) == sorted(held)
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    for text in project["dependencies"] + project["optional-dependencies"]["gui"]:
        wanted = Requirement(text)
        version = held[canonicalize_name(wanted.name)]
        assert wanted.specifier.contains(version), f"{text}: {version}"
