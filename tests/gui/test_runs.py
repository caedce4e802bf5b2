"""The run browser: what is chosen, what is on screen, and what can be done."""

from dataclasses import replace
from pathlib import Path

import pytest
from PySide6.QtCore import QEvent, Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QLabel, QPushButton
from shiboken6 import isValid

import tactile_lab
from gui.lanes.compare import MARKS
from gui.look.theme import Theme
from gui.record.progress import ENDS
from gui.review.run_card import PILLS, RunCard, differing
from gui.review.runs import PAGE, RunsView
from tactile_lab.store.folder import DATA, RunFolder
from tactile_lab.store.summary import RunSummary


def summary(name: str, title: str, status: str, **more: object) -> RunSummary:
    return RunSummary(
        folder=Path(name), name=name, title=title, status=status,
        started=f"2026-11-20T10:00:0{ord(name[-1]) % 10}+00:00", **more,
    )  # fmt: skip


ENTRIES = [
    summary("a", "Pulses", "complete", duration=3.0, simulated=True),
    summary(
        "b", "Staircase", "aborted", duration=9.0, operator="Curie", spikes=7,
        notes=["2.0 s: moved the magnet"], parameters={"levels": ["80 mN"]},
    ),
    summary("c", "Pulses", "faulted", duration=18.0, starred=True, tags=["paper"]),
]  # fmt: skip


@pytest.fixture
def runs(app: QApplication) -> RunsView:
    view = RunsView(Theme("light"))
    view.show_entries(ENTRIES)
    return view


def texts(view: RunsView) -> str:
    return " ".join(one.text() for one in view.findChildren(QLabel))


def test_a_run_ended_in_one_word_in_the_list_and_below_the_lanes() -> None:
    """A run that was Faulted below the lanes had a Fault in the list."""
    words = {word for word, _ in PILLS.values()}
    assert {"Complete", "Aborted", "Faulted"} <= words & ENDS.keys()


def test_nothing_can_be_done_before_a_run_is_chosen(runs: RunsView) -> None:
    assert not runs.open.isEnabled() and not runs.rerun.isEnabled()
    assert runs.open.toolTip() == "Choose a run first"
    opened: list[RunSummary] = []
    runs.opened.connect(opened.append)
    runs.order.setCurrentText("Oldest first")
    QTest.mouseClick(runs.cards[1], Qt.MouseButton.LeftButton)
    runs.open.click()
    assert opened == [ENTRIES[1]]


@pytest.mark.parametrize("folder", [Path("c"), Path("c").absolute()])
def test_run_on_screen_is_marked_and_chosen(runs: RunsView, folder: Path) -> None:
    """Also one that a file dialog named in full, where the list's are relative."""
    runs.show_current(folder)
    assert [c.accessibleName().endswith("on screen") for c in runs.cards] == [
        True, False, False,
    ]  # fmt: skip
    asked: list[RunSummary] = []
    runs.again.connect(asked.append)
    runs.rerun.click()
    assert asked == [ENTRIES[2]]


def test_a_run_that_the_search_hides_is_no_longer_chosen(runs: RunsView) -> None:
    QTest.mouseClick(runs.cards[1], Qt.MouseButton.LeftButton)
    runs.search.setText("pulses")
    assert len(runs.cards) == 2 and not runs.open.isEnabled()
    runs.search.setText("nothing like it")
    assert "No run fits" in texts(runs)


def test_a_run_with_notes_does_not_take_the_keyboard(
    app: QApplication, runs: RunsView, qtbot
) -> None:
    """A sign of its card was shown as a window, at the end of each run."""
    runs.show()
    runs.activateWindow()
    qtbot.waitUntil(runs.isActiveWindow)
    went: list[object] = []
    app.focusWindowChanged.connect(went.append)
    runs.show_entries(ENTRIES[:2])
    app.processEvents()
    app.focusWindowChanged.disconnect(went.append)
    runs.hide()
    assert not went


def test_only_what_changed_is_drawn_anew(app: QApplication, runs: RunsView) -> None:
    """All twenty cards were made again, 0.1 s of the window, when a run was added."""
    before = {card.entry.name: card for card in runs.cards}
    runs.cards[0].tick.setChecked(True)
    star = replace(ENTRIES[1], starred=True)
    runs.show_entries([ENTRIES[0], star, ENTRIES[2], summary("d", "New", "running")])
    now = {card.entry.name: card for card in runs.cards}
    assert list(now) == ["c", "b", "a", "d"]
    assert now["a"] is before["a"] and now["c"] is before["c"]
    assert now["b"] is not before["b"] and "★" in texts(runs)
    assert [one.name for one in runs.ticked()] == ["c"]
    app.sendPostedEvents(None, QEvent.Type.DeferredDelete.value)
    assert runs.findChildren(RunCard) and isValid(now["a"]) and not isValid(before["b"])


def test_an_empty_folder_says_what_comes(app: QApplication) -> None:
    assert "No runs yet" in texts(RunsView(Theme("light")))


def test_two_or_three_are_compared(runs: RunsView) -> None:
    for count, card in enumerate(runs.cards, start=1):
        QTest.keyClick(card, Qt.Key.Key_Space)
        assert runs.compare.isEnabled() is (count >= 2)
    assert sorted(runs.ticked(), key=lambda e: e.name) == ENTRIES
    marks = [card._mark.text() for card in runs.cards]
    assert marks == list(MARKS), "each bears the mark it will be compared under"


def test_a_run_whose_program_died_is_listed_as_cut_short(
    app: QApplication, tmp_path: Path
) -> None:
    run = RunFolder.create(tmp_path, "pulses", {"title": "Pulses"})
    assert [entry.status for entry in tactile_lab.runs(tmp_path)] == ["running"]
    run._log.close()  # what the kernel does when the process dies
    found = tactile_lab.runs(tmp_path)
    assert [entry.status for entry in found] == ["cut short"]
    view = RunsView(Theme("light"))
    view.show_entries(found)
    view.filter.group.button(3).click()
    assert "Cut short" in texts(view) and len(view.cards) == 1, "among the faults"


def listed(view: RunsView) -> list[str]:
    return [card.entry.name for card in view.cards]


@pytest.mark.parametrize(
    "words", ["curie", "magnet moved", "80 mn", "7 staircase aborted"]
)
def test_notes_operator_and_levels_are_found(runs: RunsView, words: str) -> None:
    runs.search.setText(words.removeprefix("7 "))
    assert listed(runs) == ["b"]


def test_runs_are_sorted_and_starred_ones_filtered(runs: RunsView) -> None:
    assert listed(runs) == ["c", "b", "a"], "the newest first"
    runs.order.setCurrentText("Most spikes first")
    assert listed(runs)[0] == "b"
    runs.filter.group.button(4).click()
    assert listed(runs) == ["c"]


def test_older_runs_are_listed_when_asked_for(runs: RunsView) -> None:
    many = [summary(f"{k:03d}", "Pulses", "complete") for k in range(PAGE + 5)]
    runs.show_entries(many)
    assert len(runs.cards) == PAGE
    (more,) = (b for b in runs.findChildren(QPushButton) if "more" in b.text())
    more.click()
    assert len(runs.cards) == PAGE + 5


def test_only_a_run_that_was_cut_short_is_recovered(runs: RunsView) -> None:
    runs.show_entries([*ENTRIES, summary("d", "Pulses", "cut short")])
    (cut,) = (card for card in runs.cards if card.entry.name == "d")
    QTest.mouseClick(cut, Qt.MouseButton.LeftButton)
    assert not runs.recover.isHidden() and runs.open.isHidden()
    menu = [one.text() for one in runs.menu_of(cut.entry).actions()]
    assert "Recover" in menu and "Delete …" in menu
    QTest.mouseClick(runs.cards[0], Qt.MouseButton.LeftButton)
    assert runs.recover.isHidden() and not runs.open.isHidden()


def test_the_keyboard_stays_where_recover_was(runs: RunsView, qtbot) -> None:
    cut = summary("d", "Pulses", "cut short")
    runs.show_entries([*ENTRIES, cut])
    runs.show()
    runs.activateWindow()
    runs._choose(cut)
    runs.recover.setFocus()
    qtbot.waitUntil(runs.recover.hasFocus)
    runs.show_entries([*ENTRIES, summary("d", "Pulses", "recovered")])
    assert runs.open.hasFocus()


def focused(runs: RunsView, qtbot, card: int) -> None:
    runs.show()
    runs.activateWindow()
    runs.cards[card].setFocus()
    qtbot.waitUntil(runs.cards[card].hasFocus)


def test_arrows_go_from_run_to_run_and_tab_comes_to_one(runs: RunsView, qtbot) -> None:
    stops = [card.focusPolicy() & Qt.FocusPolicy.TabFocus for card in runs.cards]
    assert [bool(one) for one in stops] == [True, False, False], "none is chosen yet"
    focused(runs, qtbot, 0)
    QTest.keyClick(runs.cards[0], Qt.Key.Key_Down)
    qtbot.waitUntil(runs.cards[1].hasFocus)
    stops = [card.focusPolicy() & Qt.FocusPolicy.TabFocus for card in runs.cards]
    assert [bool(one) for one in stops] == [False, True, False]
    assert runs._chosen == runs.cards[1].entry
    QTest.keyClick(runs.cards[1], Qt.Key.Key_Up)
    qtbot.waitUntil(runs.cards[0].hasFocus)
    QTest.keyClick(runs.cards[0], Qt.Key.Key_Up)
    assert runs.cards[0].hasFocus()
    runs.search.setFocus()
    QTest.keyClick(runs.search, Qt.Key.Key_Down)
    qtbot.waitUntil(runs.cards[0].hasFocus)


def test_pages_go_from_run_to_run(runs: RunsView, qtbot) -> None:
    """They scrolled the chosen run out of sight, which had the keyboard."""
    many = [replace(ENTRIES[0], folder=Path(f"{n}"), name=f"{n}") for n in range(30)]
    runs.show_entries(many)
    runs.resize(360, 600)
    focused(runs, qtbot, 0)
    end = len(runs.cards) - 1
    for key, last in ((Qt.Key.Key_PageDown, end), (Qt.Key.Key_PageUp, 0)):
        at = [card.hasFocus() for card in runs.cards].index(True)
        while at != last:
            QTest.keyClick(runs.cards[at], key)
            before, at = at, [card.hasFocus() for card in runs.cards].index(True)
            assert 1 < abs(at - before) < 8 or at == last, "as many as are seen"
            seen = runs.cards[at].visibleRegion().boundingRect()
            assert seen == runs.cards[at].rect()


def test_spikes_that_are_no_count_are_not_told_as_one(runs: RunsView) -> None:
    runs.show_entries([replace(ENTRIES[1], uncounted=True), ENTRIES[2]])
    tips = [card.toolTip() for card in runs.cards]
    assert ["spikes 7 seen, no count" in tip for tip in tips] == [False, True]
    runs.show_entries(ENTRIES)
    assert not any("no count" in card.toolTip() for card in runs.cards)


def test_a_run_killed_before_its_first_sample_says_that_nothing_was_recorded(
    runs: RunsView, tmp_path: Path
) -> None:
    """As `tactile-lab runs` says; "—" stood there as of one with samples."""
    (tmp_path / DATA).touch()
    killed = summary("a", "Pulses", "cut short")
    kept = replace(killed, name="b", folder=tmp_path)
    going_on = summary("c", "Pulses", "running")
    runs.show_entries([killed, kept, going_on])
    told = {card.entry.name: lengths(card) for card in runs.cards}
    assert told == {"a": ["none recorded"], "b": ["—"], "c": ["—"]}


def lengths(card: RunCard) -> list[str]:
    """What stands between when a run began and whether it is simulated."""
    texts = (one.text() for one in card.findChildren(QLabel))
    return [text.split(" · ")[1] for text in texts if text.endswith(" · ?")]


def test_runs_of_a_protocol_say_in_what_they_differ(runs: RunsView) -> None:
    """Their names and pictures are alike."""
    said = {"a": "80 mN", "b": "120 mN"}
    runs.show_entries(
        [
            summary(
                name, "Hold", "complete", parameters={"level": level, "ramp": "0 s"}
            )
            for name, level in said.items()
        ]
        + [summary("c", "Staircase", "complete", protocol="staircase")]
    )
    for card in runs.cards:
        level = said.get(card.entry.name)
        told = [one.text() for one in card.findChildren(QLabel)]
        assert [one for one in told if "level" in one] == [f"level {level}"] * bool(
            level
        )
        assert (f"level {level}" in card.accessibleName()) is bool(level)
        assert "ramp" not in card.toolTip(), "which is the same"


def test_compared_runs_say_in_what_they_differ() -> None:
    same = {"hold": "2 s", "drift_limit": "0.1 V"}
    runs = [
        summary("a", "Pulses", "complete", parameters={**same, "levels": levels})
        for levels in (["0.08 N", "0.12 N"], ["0.09 N"])
    ]
    assert differing(runs) == ["levels 80, 120 mN", "levels 90 mN"]
    assert differing([runs[0], runs[0]]) == ["", ""]
    other = summary("b", "Step", "complete", parameters={**same, "drift_limit": "1 V"})
    assert differing([runs[1], other])[1] == "drift limit 1 V; levels —"
    named = [summary("c", "", "complete", parameters={"order": o}) for o in ("up", [])]
    assert differing(named) == ["order up", "order —"]
