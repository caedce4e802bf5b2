"""What a run's report concluded, as its results.json holds it. No Qt here."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tactile_lab.analysis.wiring import ChannelVerdict
from tactile_lab.conclusion import Table
from tactile_lab.errors import RunFolderError, to_type
from tactile_lab.plot import Plot


@dataclass(frozen=True)
class ShownConclusion:
    """The parts of results.json that the window shows.

    Attributes:
        protocol: name.
        statements: what the run says as a whole, and what it cannot tell, and why, one
            sentence each.
        verdicts: of a wiring check, one per channel.
        tables: for people.
        plots: the protocol's own.
        calibration: file a field calibration wrote; None if there is none.
    """

    protocol: str
    statements: tuple[str, ...]
    verdicts: tuple[ChannelVerdict, ...]
    tables: tuple[Table, ...]
    plots: tuple[Plot, ...]
    calibration: Path | None


def conclusion_of(folder: Path) -> ShownConclusion:
    """What the report in a run's folder concluded.

    Raises:
        RunFolderError: there is no report, or it cannot be read.
    """
    file = folder / "results.json"
    try:
        found = json.loads(file.read_text(encoding="utf-8"))
        values = found["conclusion"] or {}
        made = folder / "calibration.csv"
        return ShownConclusion(
            protocol=found["protocol"],
            statements=(*found.get("statements", ()), *found.get("missing", ())),
            verdicts=tuple(
                ChannelVerdict(signal, bool(one["ok"]), str(one["text"]))
                for signal, one in values.get("channels", {}).items()
            ),
            tables=tuple(_table(table) for table in found.get("tables", ())),
            plots=tuple(Plot.from_dict(plot) for plot in found.get("plots", ())),
            calibration=made if made.is_file() else None,
        )
    except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
        raise RunFolderError(
            f"{file} cannot be read ({type(error).__name__}: {error}). Write the "
            f"report again: {to_type('report', folder)}"
        ) from error


def _table(data: dict[str, Any]) -> Table:
    rows = tuple(tuple(str(cell) for cell in row) for row in data["rows"])
    return Table(
        title=str(data["title"]),
        headings=tuple(data["headings"]),
        rows=rows,
        note=str(data["note"]),
    )
