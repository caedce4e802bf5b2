"""The page of a lab's first day: what each step found, with its figure."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from urllib.parse import quote

from tactile_lab.errors import RunFolderError
from tactile_lab.report.html import Picture, inlined, rendered
from tactile_lab.scene.bench_file import BenchSpec
from tactile_lab.store.folder import read_info
from tactile_lab.whole_file import write_text

FIGURE, REPORT = "figure.svg", "report.html"


@dataclass(frozen=True, kw_only=True)
class DayStep:
    """What one step came to.

    Attributes:
        title: for a person.
        name: of the verb, or of the scene that was run.
        when: it was done.
        said: sentences it concluded with.
        printed: by the verb; "" for a run.
        changes: of single keys of the scene.
        run: its folder, as the page's folder has it; "" for a verb.
    """

    title: str
    name: str
    when: str
    said: Sequence[str]
    printed: str = ""
    changes: Sequence[str] = ()
    run: str = ""


def write_day(
    page: Path,
    spec: BenchSpec,
    bench: str,
    steps: Sequence[DayStep],
    notes: Mapping[str, str],
) -> None:
    """Write the page; all it shows is in it, and it leads to the runs beside it.

    Args:
        page: takes its name once it is whole.
        spec: the bench as the day left it.
        bench: its file.
        steps: in their order.
        notes: who and where.

    Raises:
        OSError: it cannot be written.
    """
    folder = page.parent
    calibration = getattr(spec.magnet, "calibration", None)
    facts = {
        "Bench file": bench,
        "Calibration": "" if calibration is None else calibration.path,
        **_instruments([folder / step.run for step in steps if step.run]),
    }
    noted = {name.capitalize(): value for name, value in notes.items()}
    text = rendered(
        "day.html",
        bench=spec.name,
        mark="Simulated bench" if spec.simulated else "Measured",
        measured=not spec.simulated,
        key={**noted, "Written": f"{datetime.now():%Y-%m-%d %H:%M}"},
        facts=facts,
        steps=[{**vars(step), **_shown(folder, step)} for step in steps],
        none="none",
    )
    write_text(page, text)


def _shown(folder: Path, step: DayStep) -> dict[str, Picture | str | None]:
    """Figure and address of a step's report, where it has them."""
    run = folder / step.run
    picture = None
    if step.run and (run / FIGURE).is_file():
        svg = (run / FIGURE).read_text(encoding="utf-8")
        picture = inlined(f"{step.title} {step.run}", "", svg)
    there = step.run and (run / REPORT).is_file()
    address = quote(f"{Path(step.run).as_posix()}/{REPORT}") if there else ""
    return {"picture": picture, "report": address}


def _instruments(runs: Sequence[Path]) -> dict[str, str]:
    """What answered in any of the runs, by its role."""
    found: dict[str, str] = {}
    for run in runs:
        with suppress(RunFolderError):
            for role, told in read_info(run).get("instruments", {}).items():
                found[role.replace("_", " ").capitalize()] = told["identity"]
    return found
