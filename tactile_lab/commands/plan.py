"""``tactile-lab plan``: what a run would take; opens nothing."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from tactile_lab.commands.options import json_option, scene_asked, scene_options
from tactile_lab.commands.terminal import print_json, refusing, say, warn, working

if TYPE_CHECKING:
    from tactile_lab.planning.plan import Plan
    from tactile_lab.scene.scene import Scene

FORMATS = (".png", ".svg", ".pdf")


def check_target(path: Path) -> None:
    """Refuse a file the preview could not be written to.

    Raises:
        SceneError: another ending, a folder, or a folder that is missing.
    """
    from tactile_lab.errors import SceneError

    if path.suffix.lower() not in FORMATS:
        raise SceneError(
            f"--preview {path}: the name must end in {', '.join(FORMATS)}."
        )
    if path.is_dir():
        raise SceneError(f"--preview {path} is a folder; a file is needed.")
    if not path.parent.is_dir():
        raise SceneError(f"--preview {path}: there is no folder {path.parent}.")


@click.command()
@scene_options
@click.option(
    "--preview",
    "picture",
    type=click.Path(path_type=Path),
    metavar="FILE",
    help="Draw the model's preview into FILE (.png, .svg or .pdf).",
)
@click.option(
    "--keys", "list_keys", is_flag=True, help="Only list all keys, as --set takes them."
)
@json_option
def command(
    scene: str | None,
    overrides: tuple[str, ...],
    bench: str | None,
    picture: Path | None,
    list_keys: bool,
    as_json: bool,
) -> None:
    """Show what SCENE (the demo unless given) needs, leaves out and costs.

    Opens no instrument, and writes nothing but the preview if that is asked for.
    """
    with refusing():
        from tactile_lab.lab import lab
        from tactile_lab.planning.plan import plan, text

        if picture is not None:
            check_target(picture)
        loaded, lab_says = scene_asked(scene, overrides, bench), lab().rows
        if list_keys:
            _list_keys(loaded, as_json)
            return
        with working("planning"):
            planned = plan(loaded)
        if picture is not None:
            _draw(planned, picture)
    if as_json:
        print_json({**planned.to_dict(), "figure": str(picture) if picture else None})
    else:
        say(text(planned))
        say("\nthe lab's defaults")
        for key, value in lab_says:
            say(f"  {key:<12}{value}")
        if picture is not None:
            say(f"preview drawn into {picture}")
    for line in planned.warnings:
        warn(line)


def _draw(planned: Plan, path: Path) -> None:
    from tactile_lab.errors import SceneError
    from tactile_lab.planning.figure import preview_plot
    from tactile_lab.report.canvas import draw
    from tactile_lab.whole_file import failing_as, replacing

    scene = planned.scene
    figure = draw(
        preview_plot(planned),
        f"{scene.name}: preview from the model",
        scene.bench.name,
        simulated=scene.bench.simulated or None,
    )
    wrong = failing_as(f"--preview {path} cannot be written", kind=SceneError)
    with wrong, replacing(path) as part:
        figure.savefig(part, dpi=160)


def _list_keys(scene: Scene, as_json: bool) -> None:
    from tactile_lab.scene.keys import keys

    found = keys(scene)
    if as_json:
        print_json({"keys": [vars(key) for key in found]})
        return
    width = min(max(len(key.name) for key in found), 30)
    for key in found:
        meaning = f"  # {key.meaning}" if key.meaning else ""
        say(f"{key.name:<{width}} = {key.value or '...'}{meaning}")
