"""Named sets of a protocol's parameters, kept as scenes that run by themselves.

``presets/pulses/strong.toml`` beside the runs folder; `tactile-lab run` takes it, too.
No Qt here.
"""

from __future__ import annotations

import re
from pathlib import Path

import tomli_w

from tactile_lab.errors import SceneError
from tactile_lab.scene.load import load
from tactile_lab.scene.scene import Scene
from tactile_lab.whole_file import failing_as, write_text


def presets(folder: Path, protocol: str) -> dict[str, Path]:
    """The presets of a protocol by name, sorted."""
    return {file.stem: file for file in sorted((folder / protocol).glob("*.toml"))}


def save_preset(folder: Path, name: str, scene: Scene) -> Path:
    """Keep a scene's parameters under `name`; one of that name is replaced.

    Raises:
        SceneError: the name or the folder cannot be used.
    """
    if not re.fullmatch(r"[\w][\w .,+-]{0,60}", name):
        raise SceneError(
            f"A preset cannot be called {name!r}; use letters, digits, spaces and "
            "- + . , up to 61 of them."
        )
    file = folder / scene.protocol.name / f"{name}.toml"
    text = tomli_w.dumps({"protocol": scene.to_dict()["protocol"]})
    with failing_as(f"The preset {file} was not kept", kind=SceneError):
        write_text(file, text)
    return file


def parameters(file: Path) -> dict[str, object]:
    """A preset's parameters, SI, by key.

    Raises:
        SceneError: the file cannot be used.
    """
    protocol = load(file).protocol
    return {key: getattr(protocol, key) for key in type(protocol).model_fields}
