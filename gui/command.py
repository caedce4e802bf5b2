"""``tactile-lab gui``: the bench window."""

from __future__ import annotations

import gc
import importlib.util
import os
import sys
from pathlib import Path

import click

from tactile_lab.commands.terminal import refusing
from tactile_lab.engine.process import load_ahead
from tactile_lab.lab import lab

DISPLAYS = ("DISPLAY", "WAYLAND_DISPLAY", "QT_QPA_PLATFORM")
INSTALL = 'pip install "PySide6-Essentials>=6.8,<6.12"'


@click.command()
@click.argument("target", required=False, metavar="[SCENE|RUN]")
@click.option(
    "--bench",
    metavar="FILE|sim|none",
    help="Bench to connect to; else that of the window's settings, at first sim.",
)
@click.option(
    "--out", type=click.Path(path_type=Path), metavar="DIR",
    help="Where run folders are put; else as the settings say, at first runs.",
)  # fmt: skip
@click.option(
    "--skin", type=click.Path(path_type=Path), metavar="FILE",
    help="Open the window of an array of sensors alone: a skin's file, or its folder.",
)  # fmt: skip
@click.option(
    "--theme", type=click.Choice(["system", "light", "dark"]), default="system",
    show_default=True, help="Colours.",
)  # fmt: skip
def command(
    target: str | None,
    bench: str | None,
    out: Path | None,
    skin: Path | None,
    theme: str,
) -> None:
    """Open the bench window, on SCENE, PROTOCOL.py or a RUN folder if given."""
    if importlib.util.find_spec("PySide6") is None:
        raise click.ClickException(
            "The window needs Qt, which is not installed. In the checkout: "
            f'pip install -e ".[gui]"; or alone: {INSTALL}'
        )
    if sys.platform == "linux" and not any(map(os.environ.get, DISPLAYS)):
        raise click.ClickException(
            "The window needs a display, and neither DISPLAY nor WAYLAND_DISPLAY names "
            "one. Start it on a desktop, or over ssh -X."
        )
    gc.disable()  # modules leave no garbage; the window collects its own (gui.garbage)
    if skin is None:
        load_ahead()  # on the other core, while Qt is loaded
    try:
        from gui import app
    except ImportError as error:
        raise click.ClickException(
            f"Qt does not load: {error}. On Debian its libraries come with: apt-get "
            "install libegl1 libgl1 libxkbcommon0 libdbus-1-3 libfontconfig1"
        ) from error
    if skin is not None:
        with refusing():
            app.show_skin(skin, out or Path("skins"), theme)
        return
    with refusing():
        known = lab()
    sys.exit(app.main(target, out=out, bench=bench, theme=theme, lab=known))
