"""What notebooks show: facts and tables as HTML that needs no style sheet."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from html import escape


def facts(title: str, rows: Iterable[tuple[str, object]]) -> str:
    """A title, if any, over a table of names and values; empty values are left out."""
    cells = "".join(
        f'<tr><th style="text-align:left;padding-right:12px">{escape(name)}</th>'
        f'<td style="text-align:left">{escape(str(value))}</td></tr>'
        for name, value in rows
        if value not in (None, "")
    )
    head = f"<p><b>{escape(title)}</b></p>" if title else ""
    return f"{head}<table>{cells}</table>"


def table(headings: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """A table under headings."""
    head = "".join(f"<th>{escape(heading)}</th>" for heading in headings)
    body = "".join(
        "<tr>" + "".join(f"<td>{escape(str(cell))}</td>" for cell in row) + "</tr>"
        for row in rows
    )
    return f"<table><tr>{head}</tr>{body}</table>"


def framed(page: str) -> str:
    """A whole HTML page, kept apart from the notebook's own styles."""
    return (
        f'<iframe srcdoc="{escape(page)}" style="width:100%;height:50em;border:0">'
        "</iframe>"
    )
