"""The files of a finished study: data set, results.json, figures, report.html."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from tactile_lab.conclusion import Conclusion
from tactile_lab.quantity import show
from tactile_lab.store.folder import write_json
from tactile_lab.studies.addresses import study_digest
from tactile_lab.studies.axes import Axis
from tactile_lab.studies.dataset import KEPT, MADE_OF, Gathered, is_written
from tactile_lab.studies.live import LIVE, RESULTS, SHOWN, shown
from tactile_lab.studies.study import Study
from tactile_lab.whole_file import failing_as, write_text

REPORT = "report.html"
MARKS = {"model": "Circuit model", "simulated": "Simulated bench", "bench": "Measured"}


def write_page(found: Gathered, folder: Path) -> tuple[Path, Conclusion]:
    """Write results.json, the figures and report.html of a study into `folder`.

    Returns:
        The page, and what it concludes.

    Raises:
        RecordingError: the folder cannot be written.
    """
    with failing_as(f"The report cannot be written into {folder}", KEPT):
        return _written(found, folder)


def _written(found: Gathered, folder: Path) -> tuple[Path, Conclusion]:
    # heavy, and a study that is finished needs neither
    from tactile_lab.report.canvas import draw, save
    from tactile_lab.report.html import picture, rendered, written
    from tactile_lab.studies.answers import conclude
    from tactile_lab.studies.figures import plots

    study, said, drawn = found.study, conclude(found), list(plots(found))
    subtitle = f"{study.scene.name} · {' × '.join(map(str, study.design.shape)) or 1}"
    pictures = []
    for plot in drawn:
        title = f"{study.title}: {plot.title}"
        figure = draw(plot, title, subtitle, simulated=study.on != "bench")
        pictures.append(picture(title, plot, save(figure, folder / plot.name)[1]))
    design = study.design
    text = rendered(
        "study.html",
        title=study.title,
        subtitle=subtitle,
        mark=MARKS[study.on],
        measured=study.on == "bench",
        key={
            "Points": f"{design.size:,}",
            "Refused or failed": f"{found.failed:,}",
            "Repeats": str(design.repeat),
            "Seed": str(design.seed),
        },
        conclusion=said,
        pictures=pictures,
        axes={axis.key: described(axis) for axis in design.axes},
        kept={one.name: one.expression for one in study.kept},
        none="none",
        made=written(),
    )
    html = folder / REPORT
    write_text(html, text)
    # last, for `told_before`
    results = {
        MADE_OF: study_digest(study),
        "text": said.text,
        SHOWN: shown(found, [*said.sentences, *said.missing], drawn, said.tables),
        **said.plain,
    }
    write_json(folder / RESULTS, results)
    (folder / LIVE).unlink(missing_ok=True)
    return html, said


def told_before(study: Study, folder: Path) -> dict[str, Any] | None:
    """results.json of this very study where all its files are there; else None."""
    try:
        told: dict[str, Any] = json.loads((folder / RESULTS).read_text("utf-8"))
    except (OSError, ValueError):
        return None
    whole = (folder / REPORT).is_file() and is_written(study, folder)
    return told if whole and told.get(MADE_OF) == study_digest(study) else None


def described(axis: Axis) -> str:
    """What an axis takes, for a person."""
    if axis.spread is not None:
        centre, width = (
            show(value, axis.unit) for value in (axis.spread.centre, axis.spread.width)
        )
        return f"{axis.spread.kind}, {centre} ± {width}"
    shown = [axis.shown(value) for value in axis.values]
    if len(shown) > 6:
        return f"{shown[0]}, {shown[1]}, ... {shown[-1]} ({len(shown)} values)"
    return ", ".join(shown)
