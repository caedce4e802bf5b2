"""Several runs on one page, against what can be computed by hand."""

from pathlib import Path
from typing import Any

import pytest

from tactile_lab.report.several import OneOfSeveral, SeveralRuns
from tactile_lab.store.facts import Fact
from tactile_lab.store.summary import RunSummary


def run(name: str, sensor: str, taus: Any, rates: Any = (), **said: Any) -> Any:
    about: dict[str, Any] = {"status": "complete", "sensor": sensor, **said}
    entry = RunSummary(folder=Path(name), name=name, **about)
    numbers = {"tau": [Fact("tau", one, unit="s") for one in taus]} if taus else {}
    return OneOfSeveral(entry, tuple(rates), numbers)


RUNS = SeveralRuns(
    (
        run("a", "S1", [8.0, 8.2], [(0.1, 5.0), (0.2, 9.0)], simulated=True),
        run("b", "S1", [8.3], [(0.1, 7.0)]),
        run("c", "S2", [9.0], [(0.1, float("nan")), (0.2, 4.0)]),
        run("d", "", [], status="faulted"),
    )
)


def test_specimens_are_what_is_averaged_over() -> None:
    rows = {row[1]: row[2:] for row in RUNS.by_specimen.rows}
    assert rows["S1"] == ("2", "8.2 s", "100 ms"), "of the runs' means 8.1 and 8.3"
    assert rows["S2"] == ("1", "9 s", "")
    assert rows["all 2 specimens"] == ("", "8.6 s", "400 ms"), (
        "no run of S1 counts more"
    )


def test_rate_against_force_has_bars_where_there_are_several_runs() -> None:
    plot: Any = RUNS.plot
    first, second = plot.panels[0].series
    assert list(first.x) == [0.1, 0.2] and list(first.y) == [6.0, 9.0]
    assert first.y_error[0] == pytest.approx(12.706, rel=1e-3), "Student, one freedom"
    assert list(second.x) == [0.2] and second.y_error is None


def test_what_is_mixed_or_missing_is_said() -> None:
    said = " ".join(RUNS.sentences)
    assert "4 runs of 3 specimens" in said and "1 of them note no sensor" in said
    assert "1 of them are simulated" in said and "Not complete: d" in said


def test_spikes_that_are_no_count_are_marked() -> None:
    """17 of 60 stood there like a count, of V_K at 100 kS/s."""
    entry = RunSummary(folder=Path("a"), name="a", spikes=17, uncounted=True)
    table = SeveralRuns((OneOfSeveral(entry, (), {}), RUNS.runs[1]))
    assert table.table.rows[0][2] == "17†" and "no count" in table.table.note
    assert "no count" not in RUNS.table.note
