"""What all pages share: one file, figures inside, light or dark as one reads."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from functools import cache
from pathlib import Path
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup, escape

from tactile_lab.conclusion import Table
from tactile_lab.plot import Plot
from tactile_lab.quantity import unbroken
from tactile_lab.report import palette
from tactile_lab.report.canvas import HEAD_HEIGHT
from tactile_lab.report.taxel_map import TaxelMaps
from tactile_lab.whole_file import write_text

FITS = 12
"""Letters that any column of names holds."""


@dataclass(frozen=True)
class Picture:
    """One figure of a page: SVG without a size of its own, and its caption."""

    svg: Markup
    caption: str


def rendered(template: str, **names: Any) -> str:
    """A page: the template in this folder with these names, and the house style."""
    text = _templates().get_template(template).render(**names)
    return re.sub(r"\n\s*\n+", "\n", text).lstrip() + "\n"


@cache
def _templates() -> Environment:
    loader = PackageLoader("tactile_lab", "report")
    kept = Environment(
        loader=loader,
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    kept.filters |= {"unbroken": unbroken, "breakable": _breakable}
    style = loader.get_source(kept, "page.css")[0]
    kept.globals["style"] = Markup(_colours() + style)
    return kept


def _breakable(name: str) -> Markup:
    """The name of a setting, a long one broken behind its words where it must be."""
    if len(name) <= FITS:
        return escape(name)
    return escape(name).replace("_", Markup("_<wbr>"))


def picture(title: str, plot: Plot | TaxelMaps, svg: str) -> Picture:
    """The figure of a plot on a page of that title; see `inlined`."""
    return inlined(f"{title}: {plot.caption}", plot.caption, svg)


def inlined(described: str, caption: str, svg: str) -> Picture:
    """The figure without the heading the page has itself.

    Its colours stay as they are drawn: not every program that makes paper of a page
    knows the page's within a figure, and black came of it. Only in the dark the style
    sheet takes others.

    Args:
        described: for who cannot see it.
        caption: below it.
        svg: as matplotlib wrote it in the light palette.
    """
    inline = svg[svg.index("<svg") :]
    top = HEAD_HEIGHT * 72 - 14
    inline = re.sub(
        r'(<svg[^>]*?) width="[^"]*" height="[^"]*" viewBox="0 0 (\S+) ([^"]+)"',
        lambda m: f'{m[1]} viewBox="0 {top:g} {m[2]} {float(m[3]) - top:g}"',
        inline,
        count=1,
    )
    label = escape(described)
    inline = inline.replace("<svg", f'<svg role="img" aria-label="{label}"', 1)
    return Picture(Markup(inline), caption)


def write_page_of_runs(
    file: Path,
    *,
    title: str,
    simulated: bool,
    key: Mapping[str, str],
    said: Sequence[str],
    drawn: Picture | None,
    tables: Sequence[Table],
) -> None:
    """Write a page about several runs.

    Args:
        file: takes its name once it is whole.
        title: of the page.
        simulated: whether any of them is.
        key: short facts at its head.
        said: sentences.
        drawn: the figure; None for none.
        tables: below it.

    Raises:
        OSError: it cannot be written.
    """
    text = rendered(
        "chart.html",
        title=title,
        subtitle="",
        mark="Simulated" if simulated else "Measured",
        measured=not simulated,
        key=key,
        said=said,
        picture=drawn,
        tables=tables,
        made=written(),
    )
    write_text(file, text)


def written() -> str:
    """When a page was written, for its foot."""
    return f"Written {datetime.now(UTC):%Y-%m-%d %H:%M} UTC."


def _colours() -> str:
    light = "".join(f"--{c.name}:{c.light};" for c in palette.ALL)
    dark = "".join(f"--{c.name}:{c.dark};" for c in palette.ALL)
    drawn = "".join(
        f'svg [style*="{what}: {c.light}"]{{{what}:{c.dark}!important}}\n'
        for c in palette.ALL
        for what in ("fill", "stroke")
    )
    return (
        f":root{{{light}}}\n@media screen and (prefers-color-scheme:dark)"
        f"{{:root{{{dark}}}\n{drawn}}}\n"
    )
