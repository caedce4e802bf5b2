"""``tactile-lab plan``: what a run would take; opens nothing."""

from __future__ import annotations

from pathlib import Path

import click

from tactile_lab.commands.terminal import print_json, refusing, scene_options, warn

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
@click.option("--json", "as_json", is_flag=True, help="One JSON object on stdout.")
def command(
    scene: str | None,
    overrides: tuple[str, ...],
    bench: str | None,
    picture: Path | None,
    as_json: bool,
) -> None:
    """Show what SCENE (the demo unless given) needs, leaves out and costs.

    Opens no instrument, and writes nothing but the preview if that is asked for.
    """
    with refusing():
        from tactile_lab.planning.plan import plan
        from tactile_lab.planning.text import text
        from tactile_lab.scene.load import load

        if picture is not None:
            check_target(picture)
        planned = plan(load(scene, overrides, bench))
        if picture is not None:
            from tactile_lab.planning.figure import draw

            draw(planned, picture)
    if as_json:
        print_json({**planned.to_dict(), "figure": str(picture) if picture else None})
    else:
        click.echo(text(planned))
        if picture is not None:
            click.echo(f"preview drawn into {picture}")
    for line in planned.warnings:
        warn(line)
