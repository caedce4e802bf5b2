"""One self-contained report.html: numbers, figure, settings, certificate, warnings.

No scripts and nothing to fetch; it follows the reader's light or dark system and prints
on white paper.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from html import escape

from tactile_lab.quantity import show
from tactile_lab.report import palette
from tactile_lab.report.canvas import HEAD_HEIGHT, HEADING
from tactile_lab.report.findings import Findings
from tactile_lab.report.style import STYLE
from tactile_lab.report.table import NONE, table
from tactile_lab.report.trial_finding import TrialFinding
from tactile_lab.report.twinned import sentences

LONG = 12
"""Rows of a table one reads before anything else."""


def page(findings: Findings, pictures: Mapping[str, tuple[str, str]]) -> str:
    """The report as one HTML page.

    Args:
        findings: what to say.
        pictures: SVG text as matplotlib wrote it in the light palette, and caption,
            by the figure's name.
    """
    run = findings.run
    mark = (
        ("simulated", "Simulated bench") if run.simulated else ("measured", "Measured")
    )
    parts = [
        "<!doctype html>",
        '<html lang="en"><head><meta charset="utf-8">',
        '<meta name="viewport" content="width=device-width, initial-scale=1">',
        '<meta name="color-scheme" content="light dark">',
        f"<title>{escape(run.title)} · {escape(run.run)}</title>",
        f"<style>{_colours()}{STYLE}[id^={HEADING}]{{display:none}}</style></head><body><main>",
        f'<header><p class="mark {mark[0]}">{mark[1]}</p>',
        f"<h1>{escape(run.title)}</h1>",
        f'<p class="quiet">{_line((run.scene, run.run, run.started, run.bench))}</p>',
        "</header>",
        _key_numbers(findings),
        _list("warning", "Warnings", run.warnings),
        _list("warning", "Not determined", findings.missing),
        _list("conclusion", "Result", findings.conclusion.sentences),
        *_trials_and_figures(findings, pictures),
        _beside(findings),
        _figure(findings, pictures.get("twin")),
        _drift(findings, pictures.get("drift")),
        _fits(findings.trials),
        _certificate(findings),
        _list("assumption", "Assumptions", (*run.assumptions, *findings.notes)),
        _settings(findings),
        "</main></body></html>",
    ]
    return "\n".join(part for part in parts if part) + "\n"


def _line(parts: Iterable[str]) -> str:
    return " · ".join(escape(part) for part in parts if part)


def _key_numbers(findings: Findings) -> str:
    run = findings.run
    spikes = sum(t.response.spikes for t in findings.trials)
    cells = [("Status", run.status), ("Duration", show(run.duration, "s"))]
    cells += [("Trials", str(len(findings.trials))), ("Spikes", str(spikes))]
    if run.loss is not None:
        lost = run.loss.sentence.removeprefix("loss: ")
        cells.append(("Lost", lost))
    if run.took is not None:
        cells.append(("Took", show(run.took, "s", 3)))
    items = "".join(
        f"<div><dt>{escape(name)}</dt><dd>{escape(value)}</dd></div>"
        for name, value in cells
    )
    return f'<dl class="key">{items}</dl>'


def _list(kind: str, title: str, sentences: Iterable[str]) -> str:
    items = "".join(f"<li>{escape(sentence)}</li>" for sentence in sentences)
    if not items:
        return ""
    return f'<section class="{kind}"><h2>{title}</h2><ul>{items}</ul></section>'


def _results(findings: Findings) -> str:
    shown = table(findings)
    head = "".join(f'<th scope="col">{escape(h)}</th>' for h in shown.headings)
    rows = "".join(
        "<tr>" + "".join(f"<td>{escape(cell)}</td>" for cell in row) + "</tr>"
        for row in shown.rows
    )
    if not rows:
        return "<section><h2>Trials</h2><p>No trial was completed.</p></section>"
    return (
        '<section><h2>Trials</h2><div class="wide"><table class="results">'
        f"<thead><tr>{head}</tr></thead><tbody>{rows}</tbody></table></div>"
        f'<p class="quiet">{_legend(findings)}</p></section>'
    )


def _legend(findings: Findings) -> str:
    if not findings.run.searched:
        return "V_K was not searched for spikes."
    return (
        "First spike: time from the onset of the force, ± how well the clocks of coil "
        "and scope are aligned. Final rate: "
        "of the last two spikes within the hold. Fall: from the highest rate within "
        "the hold to the final one. Time constant: 1/|β| with its 95 % interval."
        + (
            " Force: ± its 95 % uncertainty by calibration and geometry."
            if findings.run.force_uncertainty is not None
            else ""
        )
    )


def _trials_and_figures(
    findings: Findings, pictures: Mapping[str, tuple[str, str]]
) -> tuple[str, ...]:
    """A short table stands before the figures, a long one after them."""
    drawn = tuple(_figure(findings, pictures.get(n)) for n in ("summary", "figure"))
    if len(findings.trials) > LONG:
        return *drawn, _results(findings)
    return _results(findings), *drawn


def _figure(findings: Findings, picture: tuple[str, str] | None) -> str:
    if picture is None:
        return ""
    svg, caption = picture
    described = f"{findings.run.title}: {caption}"
    inline = _themed(svg[svg.index("<svg") :])
    inline = inline.replace(
        "<svg", f'<svg role="img" aria-label="{escape(described)}"', 1
    )
    return f"<figure>{inline}<figcaption>{escape(caption)}</figcaption></figure>"


def _beside(findings: Findings) -> str:
    if findings.twin is None:
        return ""
    return _list(
        "twin", "Beside the model (driven by the applied current)",
        sentences(findings.run, findings.twin),
    )  # fmt: skip


def _themed(svg: str) -> str:
    """Swap the light palette for the page's variables, for dark readers."""
    names = {colour.light: colour.name for colour in palette.ALL}
    svg = re.sub(
        r"#[0-9a-f]{6}\b",
        lambda m: f"var(--{names[m[0]]}, {m[0]})" if m[0] in names else m[0],
        svg,
    )
    return re.sub(
        r'(<svg[^>]*?) width="[^"]*" height="[^"]*" viewBox="0 0 (\S+) ([^"]+)"',
        _cropped,
        svg,
        count=1,
    )


def _cropped(match: re.Match[str]) -> str:
    """Without a fixed size, and without the heading, which the page has itself."""
    top = HEAD_HEIGHT * 72 - 14
    return f'{match[1]} viewBox="0 {top:g} {match[2]} {float(match[3]) - top:g}"'


def _drift(findings: Findings, picture: tuple[str, str] | None) -> str:
    """Rest V_C1 before every trial."""
    if picture is None:
        return ""
    judged = [t.trial for t in findings.trials if t.trial.drift is not None]
    rest = [t.rest for t in judged if t.rest is not None]
    most = max((t.drift for t in judged if t.drift is not None), key=abs)
    said = (
        f"V_C1 rested between {show(min(rest), 'V')} and {show(max(rest), 'V')}. Less "
        "what the film remembers of earlier forces it drifted by "
        f"{show(most, 'V', 2)} at most."
    )
    return _list("drift", "V_C1 at rest before each trial", (said,)) + _figure(
        findings, picture
    )


def _fits(trials: Iterable[TrialFinding]) -> str:
    rows = ""
    for finding in trials:
        fit = finding.adaptation
        if fit is None:
            continue
        cells = [finding.trial.label]
        for estimate, unit in ((fit.alpha, "Hz"), (fit.beta, "1/s"), (fit.gamma, "Hz")):
            spread = f"{_true(estimate.low)} to {_true(estimate.high)}"
            cells.append(f"{_true(estimate.value)} {unit} ({spread})")
        cells += [f"{fit.irregularity:.3f}", f"{fit.r_squared:.4f}", str(fit.intervals)]
        rows += "<tr>" + "".join(f"<td>{escape(c)}</td>" for c in cells) + "</tr>"
    if not rows:
        return ""
    head = "".join(
        f'<th scope="col">{h}</th>'
        for h in ("Trial", "α", "β", "γ", "Irregularity", "R²", "Intervals")
    )
    return (
        "<section><h2>Adaptation: α exp(βt) + γ</h2>"
        f'<div class="wide"><table class="results"><thead><tr>{head}</tr></thead>'
        f"<tbody>{rows}</tbody></table></div>"
        '<p class="quiet">95 % intervals in brackets; t from the start of the hold. '
        "The exponential describes the decay; it is not the law of this circuit. Where "
        "the rates leave the curve systematically, the intervals are too narrow."
        "</p></section>"
    )


def _true(value: float) -> str:
    return f"{value:.4g}".replace("-", "−")


def _count(number: int | None, otherwise: str = "") -> str:
    return otherwise if number is None else f"{number:,}"


def _certificate(findings: Findings) -> str:
    run = findings.run
    rows: dict[str, str] = {}
    if run.loss is not None:
        loss = run.loss
        rows["Samples produced"] = _count(loss.samples_produced, "not known")
        rows["Samples stored"] = _count(loss.samples_stored)
        rows["Samples lost"] = _count(loss.samples, "not known")
        if loss.covered is not None and loss.streamed is not None:
            rows["Time covered"] = (
                f"{loss.covered:.4g} of {loss.streamed:.4g} s; gaps by design"
            )
        rows["Spikes found on line"] = _count(loss.spikes_online)
        rows["Differing when searched again"] = _count(
            loss.spikes, "not possible: the searched channel was not stored"
        )
    else:
        rows["Loss"] = "nothing was acquired"
    if run.accuracy:
        rows["Accuracy"] = run.accuracy
    return f"<section><h2>Loss certificate</h2>{_pairs(rows)}</section>"


def _settings(findings: Findings) -> str:
    run = findings.run
    groups: list[tuple[str, Mapping[str, str]]] = [
        ("Protocol", run.parameters),
        ("Sensor", run.sensor),
        ("Calibration", run.calibration),
        *((name.capitalize(), values) for name, values in run.settings.items()),
        ("Conditions", run.conditions),
        ("Environment", run.environment),
    ]
    blocks = "".join(
        f"<div><h3>{escape(name)}</h3>{_pairs(values)}</div>"
        for name, values in groups
        if values
    )
    if not blocks:
        return ""
    return f'<section><h2>Settings</h2><div class="columns">{blocks}</div></section>'


def _pairs(values: Mapping[str, str]) -> str:
    rows = "".join(
        f'<tr><th scope="row">{escape(name)}</th><td>{escape(value or NONE)}</td></tr>'
        for name, value in values.items()
    )
    return f'<table class="pairs">{rows}</table>'


def _colours() -> str:
    light = "".join(f"--{c.name}:{c.light};" for c in palette.ALL)
    dark = "".join(f"--{c.name}:{c.dark};" for c in palette.ALL)
    return (
        f":root{{{light}}}@media screen and (prefers-color-scheme:dark)"
        f"{{:root{{{dark}}}}}"
    )
