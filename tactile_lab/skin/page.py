"""The page of a skin: a film of its spikes, a raster, the rate of all."""

from __future__ import annotations

import base64
import json
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np
from markupsafe import Markup
from matplotlib.figure import Figure

from tactile_lab.plot import Panel, Plot, Series
from tactile_lab.quantity import show
from tactile_lab.report.canvas import draw, save
from tactile_lab.report.html import picture, rendered, written
from tactile_lab.report.taxel_map import TaxelMap, TaxelMaps, draw_maps
from tactile_lab.skin.adaptation import SkinAdaptation
from tactile_lab.skin.events import Events
from tactile_lab.skin.press import Pressed
from tactile_lab.skin.receptive import receptive_plot
from tactile_lab.skin.skin import Skin
from tactile_lab.skin.squares import Squares, squares_of
from tactile_lab.whole_file import write_text

FRAMES = 200
"""Of a film."""
PAUSE = 50
"""Time for which a frame is shown, ms."""
FADING = 0.75
"""What is left of a spike's colour in the next frame."""
DOTS = 20_000
"""Most events in the raster; of more, every so many-th is drawn."""
BINS = 200
"""Of the rate of all taxels."""


def write_page(
    skin: Skin,
    events: Events,
    done: Pressed,
    adaptation: SkinAdaptation | None,
    folder: Path,
) -> Path:
    """Write `report.html` and its figures beside the events.

    Raises:
        OSError: the folder cannot be written.
    """
    size = skin.array.size
    subtitle = f"{size:,} taxels · {show(skin.duration, 's')}"
    shown = maps(skin, events, adaptation)
    drawn: list[tuple[Plot | TaxelMaps, Figure]] = [
        (shown, draw_maps(shown, skin.title, subtitle))
    ]
    for plot in (raster(events), receptive_plot(skin, events)):
        if plot is not None:
            drawn.append((plot, draw(plot, skin.title, subtitle, simulated=True)))
    text = rendered(
        "skin.html",
        title=skin.title,
        subtitle=subtitle,
        key={
            "Spikes": f"{done.events:,}",
            "Taxels that fired": f"{done.taxels['fired']:,} of {size:,}",
            "Left out": f"{done.taxels['left out']:,}",
            "Spike times within": show(done.error, "s", 2),
            "Computed in": show(done.seconds, "s", 2),
        },
        warnings=done.warnings,
        film=film(skin, events),
        pictures=[
            picture(skin.title, plot, save(figure, folder / plot.name)[1])
            for plot, figure in drawn
        ],
        settings=settings(skin),
        none="none",
        made=f"{written()} Spike times are as "
        "exact as said above for the force in straight pieces; taxels left out were "
        "shown to stay below threshold and not solved.",
    )
    html = folder / "report.html"
    write_text(html, text)
    return html


def settings(skin: Skin) -> dict[str, str]:
    """What the skin is, for a person."""
    array = skin.array
    kinds = [one.kind for one in skin.stimuli] + [one.kind for one in skin.frames]
    spread = "within the tolerances of their parts" if array.spread else "as marked"
    return {
        "Taxels": f"{show(array.side, 'm')} wide, {show(array.depth, 'm')} deep, parts "
        f"{spread}",
        "Layer": f"elastic half-space, effective modulus {show(array.modulus, 'Pa')}",
        "Stimuli": ", ".join(kinds),
        "Force": f"straight pieces within {show(skin.force_error, 'N')}",
        "Dead": ", ".join(map(str, array.dead)),
        "Stuck": ", ".join(map(str, array.stuck)),
    }


def maps(skin: Skin, events: Events, adaptation: SkinAdaptation | None) -> TaxelMaps:
    """The mean rate of each taxel, and how far it falls while the load rests."""
    array, squares = skin.array, squares_of(skin.array)
    dead, stuck = array.named(array.dead), array.named(array.stuck)
    left_out = stuck if squares.single else stuck | dead
    rate = np.where(left_out, np.nan, events.count / events.duration)
    shown = [TaxelMap(label="Mean rate", unit="Hz", values=squares.mean(rate))]
    caption = (
        "Taxels where they lie, seen from above: spikes of each over the whole "
        f"{show(events.duration, 's')}"
    )
    if adaptation is None:
        caption += ". No map of adaptation: the load never rests."
    else:
        fall = squares.mean(np.maximum(adaptation.fall, 0.0))
        rare = np.isnan(fall) & (squares.total(adaptation.rare) > 0)
        silent = squares.total(adaptation.silent)
        shown.append(
            TaxelMap(
                label="Fall of the rate",
                unit="%",
                values=fall,
                most=1.0,
                grey=("too few spikes", rare),
                dotted=("fell silent", silent > 0.5 * squares.total(adaptation.known)),
            )
        )
        error = np.nanmax(100 * adaptation.error[adaptation.known], initial=0.0)
        caption += (
            f"; and adaptation: {adaptation.told}. The fall is from the highest 1/ISI "
            "within that time to the last one, as a part of the former; spike times "
            f"let it err by at most {max(error, 0.01):.1g} points of 100. Two whole "
            "intervals are needed. Who fell silent, twice the last interval before the "
            "end, fell further than its last interval says."
        )
    one_each = squares.single
    if not one_each:
        caption += (
            f" {gathered(squares)} Its colour is the mean of those that are neither "
            "dead nor stuck and whose value is known; it is marked as silent where "
            "more than half of them fell silent."
        )
    return TaxelMaps(
        name="maps",
        caption=caption,
        places=squares.places,
        side=squares.side,
        maps=tuple(shown),
        crossed=("dead", squares.total(dead & one_each) > 0),
        framed=("stuck", squares.total(stuck & one_each) > 0),
    )


def gathered(squares: Squares) -> str:
    """How many taxels a square stands for, where it is several."""
    return (
        f"There are more taxels than squares can be seen: {squares.of_taxel.size:,} "
        f"are drawn as {squares.places.shape[0]:,} squares of up to {squares.fullest} "
        "taxels each."
    )


def raster(events: Events) -> Plot:
    """Every spike, by taxel, and the mean rate of all taxels."""
    time = events.time
    every = max(1, -(-time.shape[0] // DOTS))
    edges = np.linspace(0.0, events.duration, BINS + 1)
    step = 1 << 22
    counts = np.zeros(BINS)
    for first in range(0, time.shape[0], step):
        counts += np.histogram(time[first : first + step], edges)[0]
    rate = counts / (edges[1] * events.places.shape[0])
    part = "" if every == 1 else f" One of {every} spikes is drawn."
    return Plot(
        name="raster",
        caption="Every dot is a spike of the taxel with that number, row by row from "
        f"the top left; below, spikes per taxel and time in {show(edges[1], 's', 2)}."
        + part,
        title="Spikes",
        x_label="Time",
        x_unit="s",
        x_prefix="",
        x_limits=(0.0, events.duration),
        panels=(
            Panel(
                label="Taxel",
                series=(
                    Series(
                        x=time[::every],
                        y=events.taxel[::every].astype(float),
                        mark="dots",
                        colour="V_K",
                    ),
                ),
                limits=(-1.0, float(events.places.shape[0])),
                height=3.6,
            ),
            Panel(
                label="Mean rate",
                unit="Hz",
                prefix="",
                series=(Series(x=edges, y=np.append(rate, rate[-1]), mark="steps"),),
                limits=(0.0, None),
                height=1.6,
            ),
        ),
        letters=True,
    )


def film(skin: Skin, events: Events) -> dict[str, Any]:
    """What the page plays: spikes per taxel and frame, for its script."""
    array, squares = skin.array, squares_of(skin.array)
    size, one_each = squares.places.shape[0], squares.single
    whole = ~array.named(array.stuck)
    shown = whole | one_each  # among several, a stuck one would hide the others
    counts = np.zeros((FRAMES, size), np.int64)
    time, step = events.time, 1 << 22
    for first in range(0, time.shape[0], step):
        taxel = events.taxel[first : first + step]
        when = time[first : first + step][shown[taxel]]
        frame = (when / events.duration * FRAMES).astype(int)
        at = np.minimum(frame, FRAMES - 1), squares.of_taxel[taxel[shown[taxel]]]
        np.add.at(counts, at, 1)
    long = events.duration / FRAMES
    scaled = squares.total(whole) > 0
    faded, brightest = np.zeros(size), 0.0
    for frame in counts:
        faded = FADING * faded + frame
        brightest = max(brightest, float(faded[scaled].max(initial=0.0)))
    most_of_all = counts[:, scaled].sum(axis=0).max(initial=1)
    kinds = ("<u1", "<u2", "<u4")
    kind = next(k for k in map(np.dtype, kinds) if counts.max() < 1 << 8 * k.itemsize)
    data = {
        "x": np.round(squares.places[:, 0], 9).tolist(),
        "y": np.round(squares.places[:, 1], 9).tolist(),
        "side": squares.side,
        "dead": array.dead if one_each else (),
        "stuck": array.stuck if one_each else (),
        "frames": FRAMES,
        "pause": PAUSE,
        "fullest": int(counts[:, scaled].sum(axis=1).argmax()),
        "from": long / 2,
        "step": long,
        "fading": FADING,
        "most": brightest or 1.0,
        "most_of_all": int(most_of_all),
        "bytes": kind.itemsize,
        "counts": base64.b64encode(counts.astype(kind).tobytes()).decode(),
    }
    script = resources.files("tactile_lab.report") / "film.js"
    square, most = "taxel where it lies", "any taxel"
    marked = "" if not array.dead else " Crossed out: dead."
    marked += "" if not array.stuck else " Framed: stuck, left out of full colour."
    if not one_each:
        square, most = "part of the skin", "any square"
        marked = f" {gathered(squares)}"
        marked += "" if not array.stuck else " Stuck ones are left out."
    return {
        "frames": FRAMES,
        "data": Markup(json.dumps(data).replace("<", "\\u003c")),
        "script": Markup(script.read_text(encoding="utf-8")),
        "caption": f"Each square is a {square}, seen from above, x to the "
        f"right. A frame lasts {show(long, 's', 2)} and is played in {PAUSE} ms; "
        f"{100 - 100 * FADING:.0f} % of a spike's colour fades from frame to frame. "
        f"Full colour: the most {most} comes to, {most_of_all:,} for all spikes."
        f"{marked}",
    }
