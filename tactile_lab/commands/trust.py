"""``tactile-lab trust``: let the code that a run from elsewhere holds be executed."""

from __future__ import annotations

from pathlib import Path

import click

from tactile_lab.commands.options import run_argument
from tactile_lab.commands.terminal import refusing, say


@click.command()
@run_argument
def command(run: Path) -> None:
    """Let the code that RUN was made from be executed here, and say what it is.

    To report, identify, plan or repeat a run executes its protocol and its drivers
    where they are somebody's own. Those of runs recorded here are known; read those of
    a run you were sent before you trust them.
    """
    with refusing():
        from tactile_lab.errors import SceneError
        from tactile_lab.scene.load import read_toml
        from tactile_lab.store.folder import SCENE, digest, read_info
        from tactile_lab.trust import code_named, known_file, remember
        from tactile_lab.whole_file import failing_as

        recorded = read_info(run).get("files") or {}
        code = code_named(read_toml(run / SCENE, "Scene"), run)
        for path in code:
            name = "/".join(path.parts[-2:])
            found = digest(path.read_bytes())
            state = "as it was recorded"
            if name not in recorded:
                state = "of which the run recorded nothing"
            elif recorded[name] != found:
                state = "NOT AS IT WAS RECORDED"
            say(f"{path}  sha256 {found[:16]}, {state}")
        advice = "Let the environment variable XDG_DATA_HOME name another folder."
        with failing_as(f"{known_file()} cannot be written", advice, SceneError):
            remember(code)
    say("trusted from now on" if code else f"{run} holds no code of anybody's own")
