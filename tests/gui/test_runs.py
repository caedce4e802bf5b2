"""The run browser: what is chosen, what is on screen, and what can be done."""

from pathlib import Path

import pytest
from PySide6.QtCore import Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QLabel

from gui.look.theme import Theme
from gui.review.entries import Entry, entries
from gui.review.runs import RunsView
from tactile_lab.store.folder import RunFolder

ENTRIES = [
    Entry(Path("a"), "Pulses", "demo", "complete", "today 10:00", 18.0, True),
    Entry(Path("b"), "Staircase", "stairs", "aborted", "today 09:00", 9.0, True),
    Entry(Path("c"), "Pulses", "demo", "faulted", "today 08:00", 3.0, False),
]


@pytest.fixture
def runs(app: QApplication) -> RunsView:
    view = RunsView(Theme("light"))
    view.show_entries(ENTRIES)
    return view


def texts(view: RunsView) -> str:
    return " ".join(one.text() for one in view.findChildren(QLabel))


def test_nothing_can_be_done_before_a_run_is_chosen(runs: RunsView) -> None:
    assert not runs.open.isEnabled() and not runs.rerun.isEnabled()
    assert runs.open.toolTip() == "Choose a run first"
    opened: list[Entry] = []
    runs.opened.connect(opened.append)
    QTest.mouseClick(runs.cards[1], Qt.MouseButton.LeftButton)
    runs.open.click()
    assert opened == [ENTRIES[1]]


def test_run_on_screen_is_marked_and_chosen(runs: RunsView) -> None:
    runs.show_current(Path("c"))
    assert [c.accessibleName().endswith("on screen") for c in runs.cards] == [
        False, False, True,
    ]  # fmt: skip
    asked: list[Entry] = []
    runs.again.connect(asked.append)
    runs.rerun.click()
    assert asked == [ENTRIES[2]]


def test_a_run_that_the_search_hides_is_no_longer_chosen(runs: RunsView) -> None:
    QTest.mouseClick(runs.cards[1], Qt.MouseButton.LeftButton)
    runs.search.setText("pulses")
    assert len(runs.cards) == 2 and not runs.open.isEnabled()
    runs.search.setText("nothing like it")
    assert "No run fits" in texts(runs)


def test_an_empty_folder_says_what_comes(app: QApplication) -> None:
    assert "No runs yet" in texts(RunsView(Theme("light")))


def test_two_or_three_are_compared(runs: RunsView) -> None:
    for count, card in enumerate(runs.cards, start=1):
        QTest.keyClick(card, Qt.Key.Key_Space)
        assert runs.compare.isEnabled() is (count >= 2)
    assert runs.ticked() == ENTRIES


def test_a_run_whose_program_died_is_listed_as_cut_short(
    app: QApplication, tmp_path: Path
) -> None:
    run = RunFolder.create(tmp_path, "pulses", {"title": "Pulses"})
    assert [entry.status for entry in entries(tmp_path)] == ["running"]
    run._log.close()  # what the kernel does when the process dies
    found = entries(tmp_path)
    assert [entry.status for entry in found] == ["cut short"]
    view = RunsView(Theme("light"))
    view.show_entries(found)
    view.filter.group.button(3).click()
    assert "cut short" in texts(view) and len(view.cards) == 1, "among the faults"
