"""``tactile-lab skin``: an array of sensors under a load, to events."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from tactile_lab.commands.options import exports_option, json_option, scheduler_option
from tactile_lab.commands.terminal import (
    ProgressLine,
    print_json,
    refusing,
    say,
    warn,
    working,
)
from tactile_lab.neuro.formats import SPIKES

if TYPE_CHECKING:
    from tactile_lab.skin.adaptation import SkinAdaptation
    from tactile_lab.skin.press import Pressed
    from tactile_lab.skin.skin import Skin


@click.command()
@click.argument("skin", type=click.Path(path_type=Path), required=False)
@click.option(
    "--plan", "only_plan", is_flag=True, help="Say what it is; compute nothing."
)
@click.option(
    "--out",
    type=click.Path(path_type=Path, file_okay=False),
    default=Path("skins"),
    show_default=True,
    metavar="DIR",
    help="Where a folder for the skin is put.",
)
@click.option(
    "--cores",
    type=click.IntRange(min=1),
    metavar="N",
    help="Threads; as many as cores unless given.",
)
@exports_option(
    "Also write the spikes as FILE, whose ending says how: "
    + ", ".join(one.ending for one in SPIKES.values())
)
@click.option(
    "--window", is_flag=True, help="Show it in a window as it is computed; no page."
)
@click.option(
    "--dataset",
    type=click.Path(path_type=Path, file_okay=False),
    metavar="FOLDER",
    help="Instead of SKIN: make a benchmark data set of touches, and score it.",
)
@click.option(
    "--touches",
    type=click.IntRange(8, 100_000),
    default=160,
    show_default=True,
    metavar="N",
    help="Of each task of the data set, for training and again for test.",
)
@click.option(
    "--seed",
    type=click.IntRange(0, 2**31),
    default=1,
    show_default=True,
    metavar="N",
    help="Of the data set.",
)
@scheduler_option
@json_option
def command(
    skin: Path | None,
    only_plan: bool,
    out: Path,
    cores: int | None,
    exports: tuple[Path, ...],
    window: bool,
    dataset: Path | None,
    touches: int,
    seed: int,
    scheduler: str | None,
    as_json: bool,
) -> None:
    """Press on the array of sensors that SKIN, a TOML file, describes.

    Writes the spikes of all taxels in order of time, and a page with a film of them.
    """
    if dataset is not None and skin is None:
        if window or only_plan or exports or scheduler:
            raise click.UsageError(
                "--dataset takes no --window, --plan, --export or --scheduler."
            )
        _make_dataset(dataset, touches, seed, cores, as_json)
        return
    if skin is None or dataset is not None:
        raise click.UsageError("Give SKIN, a TOML file, or --dataset FOLDER.")
    if scheduler and cores:
        raise click.UsageError("--scheduler takes no --cores: its workers compute.")
    if window:
        _show(skin, out, only_plan, cores, exports, scheduler, as_json)
        return
    with refusing():
        from tactile_lab.neuro.formats import format_of, write
        from tactile_lab.skin.adaptation import adaptation_of
        from tactile_lab.skin.events import Events
        from tactile_lab.skin.page import write_page
        from tactile_lab.skin.press import highest, press
        from tactile_lab.skin.skin import load_skin

        for file in exports:
            format_of(file)
        asked = load_skin(skin)
        force, warnings = highest(asked)
        for text in warnings:
            warn(text)
        if only_plan:
            _print_plan(asked, force)
            return
        folder = out / asked.name
        with ProgressLine(asked.array.size, asked.name) as line:
            done = press(
                asked, folder, cores=cores, scheduler=scheduler, tell=line.update
            )
        events = Events.read(folder)
        with working("writing the report"):
            adaptation = adaptation_of(asked, events)
            page = write_page(asked, events, done, adaptation, folder)
        for file in exports:
            with working(f"writing {file}"):
                write(events, file)
    if as_json:
        print_json(
            {
                "folder": str(folder),
                "report": str(page),
                "events": done.events,
                "taxels": done.taxels,
                "error_s": done.error,
                "adaptation": None if adaptation is None else adaptation.to_dict(),
                "run_time_s": done.seconds,
                "warnings": list(done.warnings),
            }
        )
        return
    _print(asked, done, adaptation, page)


def _show(skin: Path, out: Path, *others: object) -> None:
    """Open the window, which computes by itself."""
    if any(others):
        raise click.UsageError("--window goes with --out alone.")
    from tactile_lab.plugins import plugged_in

    with refusing():
        gui: click.Command = plugged_in("tactile_lab.verbs", "gui")
    asked = ["--skin", str(skin), "--out", str(out)]
    raise click.exceptions.Exit(gui.main(asked, standalone_mode=False) or 0)


def _make_dataset(
    folder: Path, touches: int, seed: int, cores: int | None, as_json: bool
) -> None:
    with refusing():
        from tactile_lab.skin.card import write_card
        from tactile_lab.skin.dataset import FILE, LABELS, make
        from tactile_lab.skin.decoder import coding, energy_per_spike, require_libraries

        require_libraries()
        with ProgressLine(2 * touches * len(LABELS), "touches") as line:
            data = make(seed, touches, cores=cores, tell=line.update)
        data.write(folder)
        with working("scoring"):
            codings = {task: coding(data, task) for task in LABELS}
            energy = energy_per_spike(data)
        made = f"Made by tactile-lab skin --dataset with --seed {seed}"
        card = write_card(folder, data, codings, energy, made)
    if as_json:
        print_json(
            {
                "file": str(folder / FILE),
                "card": str(card),
                "touches": data.task.size,
                "spikes": data.time.size,
                "tasks": {
                    task: {
                        "score": one.score.value,
                        "score_95": [one.score.low, one.score.high],
                        "chance": one.chance,
                        "information_bit": one.information,
                    }
                    for task, one in codings.items()
                },
                "energy_per_spike_J": energy[0],
            }
        )
        return
    say(f"{data.task.size:,} touches, {data.time.size:,} spikes")
    for task, one in codings.items():
        say(
            f"{task:<12}{one.score.value:.1%} right ({one.score.low:.1%} to "
            f"{one.score.high:.1%}, 95 %), chance {one.chance:.1%}"
        )
    say(f"{'card':<12}{card}")


def _print_plan(skin: Skin, force: float) -> None:
    from tactile_lab.quantity import show
    from tactile_lab.skin.page import settings

    say(f"{skin.title}: {skin.array.size:,} taxels, {show(skin.duration, 's')}")
    for name, value in settings(skin).items():
        if value:
            say(f"{name.lower():<12}{value}")
    say(f"{'most':<12}{show(force, 'N')} on one taxel at the corners of the stimuli")
    say("Taxels whose force cannot bring them to threshold are left out as it runs.")


def _print(
    skin: Skin, done: Pressed, adaptation: SkinAdaptation | None, page: Path
) -> None:
    from tactile_lab.quantity import show

    say(f"{skin.title}: {skin.array.size:,} taxels, {show(skin.duration, 's')}")
    say(f"spikes      {done.events:,}")
    told = ", ".join(f"{n:,} {what}" for what, n in done.taxels.items() if n)
    say(f"taxels      {told}")
    say(f"error       at most about {show(done.error, 's', 2)} in spike times")
    fall = "the load never rests" if adaptation is None else adaptation.told
    say(f"adaptation  {fall}")
    say(f"run time    {show(done.seconds, 's', 3)}")
    say(f"report      {page}")
