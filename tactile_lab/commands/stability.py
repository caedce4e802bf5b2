"""``tactile-lab stability``: extreme cases, ours and other solvers."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from tactile_lab.commands.terminal import refusing

if TYPE_CHECKING:
    from tactile_lab.validation.contest import Row, Truth
    from tactile_lab.validation.extremes import Extreme


@click.command()
@click.option(
    "--out",
    type=click.Path(path_type=Path, file_okay=False),
    metavar="DIR",
    help="Write stability.md there.",
)
@click.option("--case", "names", multiple=True, metavar="TEXT", help="Only these.")
@click.option(
    "--cap", default=3.0, show_default=True, help="Most CPU time per rival, s."
)
@click.option("--ours", "alone", is_flag=True, help="Leave the other solvers out.")
def command(out: Path | None, names: tuple[str, ...], cap: float, alone: bool) -> None:
    """Run the extreme cases; exit code 1 if ours is not right on every one."""
    with refusing():
        import os

        for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
            os.environ.setdefault(name, "1")
        from tactile_lab.validation.extremes import extremes

        _compile()
        lines, bad = [], 0
        for build in extremes():
            case = build()
            name = case.problem.name
            if names and not any(text in name for text in names):
                continue
            verdict, cells = _line(case, cap, alone)
            bad += verdict.startswith("**")
            lines.append(cells)
            click.echo(f"{name}: {verdict}", err=True)
        text = _report(lines, cap, alone)
        if out is None:
            click.echo(text)
        else:
            out.mkdir(parents=True, exist_ok=True)
            (out / "stability.md").write_text(text, encoding="utf-8")
            click.echo(f"Wrote {out / 'stability.md'}.")
    if bad:
        raise SystemExit(1)


RIVALS = ("RK45", "DOP853", "LSODA", "Radau", "BDF", "CVODE BDF", "Euler")


MOST_SEGMENTS = 10_000
"""More are not given to the others, which restart at each, nor to the stiffness."""


def _compile() -> None:
    """Compilation is no part of any time in the table."""
    from tactile_lab.model.circuit import Circuit
    from tactile_lab.model.simulate import simulate
    from tactile_lab.waveform import Waveform

    for circuit in (Circuit(), Circuit(saturation=True)):
        simulate(circuit, Waveform.constant(0.1), until=0.1)


def _line(case: Extreme, cap: float, alone: bool) -> tuple[str, str]:
    from tactile_lab.validation.contest import Method, judge, methods, truth

    problem = case.problem
    exact = truth(problem) if case.truth == "reference" else None
    verdict, error, spent = _ours(case, exact)
    few = problem.force.time.size <= MOST_SEGMENTS
    stiffness = f"{problem.stiffness:.0e}" if few else ""
    cells = [
        problem.name, stiffness, case.truth, verdict, error, spent,
    ]  # fmt: skip
    if not alone:
        settings = {"Euler": "dt 1e-05"}
        able = {
            (m.name, m.setting): m for m in methods(1, spice_too=False)
        }  # fmt: skip
        for name in RIVALS:
            method: Method | None = able.get((name, settings.get(name, "tol 1e-09")))
            if method is None or case.truth == "refuse":
                cells.append("")
            elif problem.force.time.size > MOST_SEGMENTS or (
                name == "Euler" and problem.circuit.saturation
            ):
                cells.append("not run")
            elif exact is None:
                cells.append(_unjudged(case, method, cap))
            else:
                cells.append(_rival(judge(problem, method, exact, cap)))
    return verdict, "| " + " | ".join(cells) + " |"


def _ours(case: Extreme, exact: Truth | None) -> tuple[str, str, str]:
    """Verdict, error and time of ours; a verdict in bold is a defeat."""
    import numpy as np

    from tactile_lab.errors import TactileLabError
    from tactile_lab.model.simulate import simulate
    from tactile_lab.quantity import show
    from tactile_lab.validation.extremes import formula
    from tactile_lab.validation.stopwatch import spent

    p = case.problem
    keep = ("statistics",) if case.statistics else ("spikes", "statistics")

    def run(tolerance: float = 1e-9):  # type: ignore[no-untyped-def]
        return simulate(
            p.circuit, p.force, until=p.until, start=p.start, keep=keep,
            tolerance=tolerance,
        )  # fmt: skip

    began = spent()
    try:
        found = run()
    except TactileLabError as error:
        took = show(spent() - began, "s", 3)
        good = case.truth == "refuse"
        return ("refused" if good else f"**refused: {error}**"), "", took
    took = show(spent() - began, "s", 3)
    statistics = found.solution.statistics
    assert statistics is not None
    end = found.end
    if not np.all(np.isfinite([end.V_P, end.V_C1, end.V_C2])):
        return "**NaN**", "", took
    if case.truth == "refuse":
        return "**answered**", "", took
    if case.truth == "formula":
        count, last = formula(p)
        assert statistics.last is not None
        gap = abs(statistics.last - last)
        good = statistics.count == count and gap <= (found.error.spike_time or 0.0)
    elif exact is None:
        other = run(1e-12).solution.statistics
        count = other.count
        gap = abs((other.last or 0.0) - (statistics.last or 0.0))
        good = statistics.count == count and gap <= 1e-9 + (
            found.error.spike_time or 0.0
        )
    else:
        count = exact.spike_times.size
        good = statistics.count == count
        gap = 0.0
        if good and count and found.spike_times is not None:
            gap = float(np.max(np.abs(found.spike_times - exact.spike_times)))
        good = good and gap <= max(found.error.spike_time or 0.0, 1e-9)
    verdict = "right" if good else f"**wrong: {statistics.count} for {count}**"
    return f"{verdict}, {statistics.count} spikes" if good else verdict, (
        f"{gap:.1e}" if count else ""
    ), took  # fmt: skip


def _rival(row: Row) -> str:
    from tactile_lab.quantity import show

    took = show(row.run_time, "s", 2)
    if row.verdict == "right":
        error = "" if not row.spikes else f" {row.spike_error:.0e}"
        return f"right{error}, {took}"
    if row.verdict == "wrong count":
        return f"wrong: {row.spikes}, {took}"
    return f"{row.verdict}, {took}"


def _unjudged(case: Extreme, method: object, cap: float) -> str:
    """A rival's answer where there is no table of true spike times."""
    import numpy as np

    from tactile_lab.model.simulate import simulate
    from tactile_lab.validation.contest import Method, Truth, judge
    from tactile_lab.validation.extremes import formula

    assert isinstance(method, Method)
    p = case.problem
    if case.truth == "formula":
        # too many to list: only the count can be judged
        times = np.zeros(formula(p)[0])
        V_C1 = 0.0
    else:
        found = simulate(p.circuit, p.force, until=p.until, tolerance=1e-12)
        assert found.spike_times is not None
        times, V_C1 = found.spike_times, found.end.V_C1
    return _rival(judge(p, method, Truth(times, V_C1), cap))


def _report(lines: list[str], cap: float, alone: bool) -> str:
    from tactile_lab.validation.tables import provenance

    rivals = () if alone else RIVALS
    heads = ["case", "stiffness ratio", "truth", "ours", "error (s)", "time", *rivals]
    return "\n".join(
        [
            "# Stability on extreme cases\n",
            f"{provenance()} Written by `tactile-lab stability --cap {cap:g} --out "
            "docs`.\n",
            "Ours at the default tolerance 1e-9 s, the others at 1e-9 with events "
            f"(Euler: 10 µs steps), each stopped after {cap:g} s; times are CPU time. "
            "Error: largest error "
            'of a spike time. Truth: "reference" is 40-digit arithmetic, "formula" '
            'Eq. (15) at constant current, "refuse" a case that has no answer and must '
            'be refused with a clear error, "finite" a case too long for the reference '
            "or decided by the last digits, where ours is compared with itself at "
            "tolerance 1e-12.\n",
            "| " + " | ".join(heads) + " |",
            "|" + "---|" * len(heads),
            *lines,
            "",
        ]
    )
