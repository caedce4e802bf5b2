"""Options that several verbs share, and what the shell completes in them."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
from click.shell_completion import CompletionItem

from tactile_lab.commands.terminal import refusing

if TYPE_CHECKING:
    from tactile_lab.scene.overrides import Overrides
    from tactile_lab.scene.scene import Scene

Decorator = Callable[[Callable[..., Any]], Callable[..., Any]]


def _scenes(ctx: click.Context, _: click.Parameter, begun: str) -> list[CompletionItem]:
    """Names of the scenes that ship, and files."""
    from tactile_lab.plugins import scene_names

    names = [name for name in scene_names() if name.startswith(begun)]
    return [*map(CompletionItem, names), CompletionItem(begun, type="file")]


def _keys(ctx: click.Context, _: click.Parameter, begun: str) -> list[CompletionItem]:
    """Keys of the scene named right after the verb, or of the demo."""
    import os

    from tactile_lab.errors import TactileLabError
    from tactile_lab.scene.keys import keys
    from tactile_lab.scene.load import load

    if "=" in begun:
        return []
    try:
        # click has parsed nothing yet: the value of --set is still missing
        words = [*os.environ.get("COMP_WORDS", "").split()[2:], "-"]
        found = keys(load(None if words[0].startswith("-") else words[0]))
    except TactileLabError:
        return []
    return [
        CompletionItem(f"{key.name}=", help=key.meaning)
        for key in found
        if key.name.startswith(begun)
    ]


def _benches(_: click.Context, __: click.Parameter, begun: str) -> list[CompletionItem]:
    return [CompletionItem("sim"), CompletionItem(begun, type="file")]


def complete_runs(
    ctx: click.Context, _: click.Parameter, begun: str
) -> list[CompletionItem]:
    """Folders of runs below the folder begun, or below ./runs; newest first."""
    found = sorted(Path().glob(f"{begun or 'runs/'}*/run.json"), reverse=True)
    found += sorted(Path().glob(f"{begun}*/run.json"), reverse=True) if begun else []
    names = dict.fromkeys(str(path.parent) for path in found)
    return [*map(CompletionItem, names)] or [CompletionItem(begun, type="dir")]


scene_argument: Decorator = click.argument(
    "scene", required=False, type=click.Path(), shell_complete=_scenes
)


def scene_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """The argument and options of all verbs that take a scene."""
    for option in (
        scene_argument,
        click.option(
            "--set",
            "overrides",
            multiple=True,
            metavar="KEY=VALUE",
            shell_complete=_keys,
            help='Change one key, such as --set record.sample_rate="100 kS/s"; '
            "`tactile-lab plan SCENE --keys` lists them.",
        ),
        click.option(
            "--bench",
            metavar="FILE|sim",
            shell_complete=_benches,
            help="Bench file to use instead of the scene's own.",
        ),
    ):
        command = option(command)
    return command


run_argument: Decorator = click.argument(
    "run", type=click.Path(path_type=Path), shell_complete=complete_runs
)


def scene_asked(scene: str | None, overrides: Overrides, bench: str | None) -> Scene:
    """The scene that somebody asked for, on the lab's bench where it names none.

    Raises:
        SceneError: it cannot be used.
    """
    from tactile_lab.lab import lab
    from tactile_lab.scene.load import load

    return load(scene, overrides, bench, lab().bench)


json_option: Decorator = click.option(
    "--json", "as_json", is_flag=True, help="One JSON object on stdout."
)


def runs_folder() -> Path:
    """Where the lab keeps its runs."""
    from tactile_lab.lab import lab

    with refusing():
        return lab().runs


runs_option: Decorator = click.option(
    "--out",
    type=click.Path(path_type=Path),
    default=runs_folder,
    metavar="DIR",
    help="Where run folders are put; else ./runs, or as lab.toml says.",
)

status_option: Decorator = click.option(
    "--status",
    metavar="tcp://HOST:PORT",
    help="Tell other programs how it goes, as JSON lines, and take their stop; port 0 "
    "takes a free one. See docs/how-to/work-with-other-programs.md.",
)

live_option: Decorator = click.option(
    "--live",
    type=click.Choice(["lsl"]),
    help="Publish spikes, envelopes and events while it runs, by Lab Streaming Layer.",
)


def exports_option(help_: str) -> Decorator:
    """``--export FILE``, repeatable, as `exports`; `help_` says what is written."""
    return click.option(
        "--export",
        "exports",
        type=click.Path(path_type=Path, dir_okay=False),
        multiple=True,
        metavar="FILE",
        help=f"{help_}; repeatable.",
    )


scheduler_option: Decorator = click.option(
    "--scheduler",
    metavar="tcp://HOST:PORT",
    help="A Dask scheduler whose workers compute instead.",
)


notes_option: Decorator = click.option(
    "--note",
    "notes",
    multiple=True,
    metavar="KEY=TEXT",
    help='Kept with the run, such as --note operator="A. Petaru".',
)


def noted(notes: tuple[str, ...]) -> dict[str, str]:
    """What the lab notes with each run, and ``--note`` options say.

    Raises:
        SceneError: one has another form.
    """
    from tactile_lab.errors import SceneError
    from tactile_lab.lab import lab

    found = lab().notes
    for note in notes:
        key, equals, text = note.partition("=")
        if not (key and equals):
            raise SceneError(
                f'--note "{note}": write KEY=TEXT, such as operator="Ada".'
            )
        found[key.strip()] = text
    return found
