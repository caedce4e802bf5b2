"""Notes: where they go, where they are seen, and how they are changed."""

import os
import shutil
import sys

import pytest
from PySide6.QtCore import QFile, Qt
from PySide6.QtTest import QTest

from gui.dialogs.saving import picture
from gui.state import WindowState
from tactile_lab.engine import jobs
from tactile_lab.store.remarks import REMARKS, add_note, read_remarks
from tactile_lab.store.run import Run


def type_note(lab, text: str) -> None:
    field = lab.window.centre.log.note
    field.setText(text)
    QTest.keyClick(field, Qt.Key.Key_Return)


def last_line(lab) -> str:
    return lab.session.log.lines[-1].text


def stored(folder) -> float:
    """How much of a run its file holds, s."""
    with Run.load(folder) as run:
        return run.duration


def test_notes_are_stamped_and_filtered(lab) -> None:
    window = lab.window
    lab.run()
    lab.until(lambda: lab.session.run.elapsed > 0)
    type_note(lab, "moved the magnet")
    window.centre.log.choices.group.button(3).click()
    shown = window.centre.log.filter
    last = shown.index(shown.rowCount() - 1, 3).data()
    assert last.startswith("moved the magnet (at ")
    window.centre.log.choices.group.button(0).click()
    (flag,) = lab.session.source.notes
    assert flag[0] > 0 and flag[1] == "moved the magnet"
    folder = lab.session.run.folder
    lab.session.stop("enough")
    lab.until(lambda: lab.session.state is WindowState.READY)
    (note,) = read_remarks(folder).notes
    assert note.text == "moved the magnet" and note.time == flag[0]


def test_a_note_before_a_run_goes_to_that_run(lab) -> None:
    lab.window.screen_.leave_run()
    lab.session.source = None
    lab.window.render_state()
    assert "next run" in lab.window.centre.log.note.placeholderText()
    type_note(lab, "another specimen")
    assert "kept for the next run" in last_line(lab)
    folder = lab.complete_run()
    assert [n.text for n in read_remarks(folder).notes] == ["another specimen"]
    assert lab.session.run.waiting == []


def test_a_note_outlives_a_run_that_is_refused(lab, monkeypatch) -> None:
    session = lab.session
    lab.window.screen_.leave_run()
    session.source = None
    type_note(lab, "the film is wet")
    nowhere = lab.folder / "a file"
    nowhere.write_text("no folder")
    monkeypatch.setattr(session.run, "out", nowhere)
    lab.window.setup.run.click()
    type_note(lab, "and the magnet moved")
    lab.until(lambda: session.state is WindowState.FAULT)
    monkeypatch.undo()
    assert session.run.waiting == ["the film is wet", "and the magnet moved"]
    lab.window.banner.acknowledge.click()
    lab.until(lambda: session.state is WindowState.READY)
    texts = [n.text for n in read_remarks(lab.complete_run()).notes]
    assert texts == ["the film is wet", "and the magnet moved"]


def test_a_note_beside_an_old_run_is_kept_with_that_run(lab) -> None:
    window, folder = lab.window, lab.runs(1)[0]
    window.screen_.open_run(folder)
    lab.until(lambda: lab.session.opened == (folder.name,))
    assert "on the run on screen" in window.centre.log.note.placeholderText()
    window.centre.view.place_cursors(0.25, 0.5)
    type_note(lab, "odd spike")
    assert "odd spike" in [n.text for n in read_remarks(folder).notes]
    assert (0.25, "odd spike") in window.screen_.run.notes, "a flag at cursor A"
    window.centre.view.clear_cursors()
    run = window.screen_.run
    kept, run.notes = run.notes, []
    without = picture(window.centre.stack, "")
    run.notes = kept
    assert picture(window.centre.stack, "") != without, "which is drawn"
    entries = window.review.runs

    def found() -> bool:
        entries.search.setText("odd spike")
        return [card.entry.folder for card in entries.cards] == [folder]

    lab.until(found)
    entries.search.clear()


def test_a_note_that_cannot_be_kept_stays_in_its_field(lab) -> None:
    """At a full disk it was told as not kept, and its words were gone."""
    window, folder = lab.window, lab.runs(1)[0]
    window.screen_.open_run(folder)
    lab.until(lambda: lab.session.opened == (folder.name,))
    remarks, aside = folder / REMARKS, folder / "aside"
    if remarks.exists():
        remarks.rename(aside)
    remarks.mkdir()
    type_note(lab, "before the lamp")
    remarks.rmdir()
    if aside.exists():
        aside.rename(remarks)
    assert "not kept" in last_line(lab)
    assert window.centre.log.note.text() == "before the lamp"
    window.centre.log.note.clear()


def test_a_report_is_written_again_for_what_is_noted_after_it(lab, monkeypatch) -> None:
    # at the lowest priority it waits for as long as other tests compute
    monkeypatch.setattr(jobs, "stand_back", lambda writing: None)
    window, folder = lab.window, lab.folder / "noted"
    shutil.copytree(lab.runs(1)[0], folder)
    report = folder / "report.html"
    window.screen_.open_run(folder)
    lab.until(lambda: lab.session.opened == (folder.name,))
    type_note(lab, "before any report")
    assert not lab.session.run.reporting, "none is wanted"
    report.write_text("written at the end of the run")
    told: list[object] = []
    lab.session.run.reported.connect(told.append)
    type_note(lab, "drifted a little")
    type_note(lab, "while it is written")
    lab.until(lambda: not lab.session.run.reporting)
    for said in "drifted a little", "while it is written":
        assert said in report.read_text()
    lab.session.run.reported.disconnect(told.append)
    assert not told, "a check that is judged now is none of an old run's report"


@pytest.mark.skipif(os.name != "posix", reason="needs a shell")
def test_one_report_is_written_at_a_time(lab, tmp_path, monkeypatch) -> None:
    told, writer = tmp_path / "told", tmp_path / "writer"
    writer.write_text(
        f"#!/bin/sh\necho begun >> {told}\nsleep 0.05\necho done >> {told}"
    )
    writer.chmod(0o700)
    monkeypatch.setattr(sys, "executable", str(writer))
    run, there = lab.session.run, []
    run.reports = True
    run.reported.connect(there.append)
    for name in "abc":
        run.report(tmp_path / name)
    run.reports = False
    lab.until(lambda: len(there) == 3)
    run.reported.disconnect(there.append)
    assert [folder.name for folder in there] == [*"abc"]
    assert told.read_text().split() == ["begun", "done"] * 3, "a quarter of a GB each"


@pytest.mark.skipif(os.name != "posix", reason="needs a shell")
def test_a_missing_report_is_written_where_it_is_looked_for(
    lab, tmp_path, monkeypatch
) -> None:
    """As that of a run whose engine died meanwhile; only the log told."""
    window, folder = lab.window, lab.folder / "unreported"
    shutil.copytree(lab.runs(1)[0], folder)
    window.screen_.open_run(folder)
    lab.until(lambda: lab.session.opened == (folder.name,))
    button, writer = window.review.results.report, tmp_path / "writer"
    let = tmp_path / "let it write"  # or it may be done before anybody has looked
    monkeypatch.setattr(sys, "executable", str(writer))
    for writes, then in (
        ("echo no room >&2; exit 3", "Write report"),
        ('echo well > "$4/report.html"', "Open report"),
    ):
        let.unlink(missing_ok=True)
        waits = f'while [ ! -e "{let}" ]; do sleep 0.01; done'
        writer.write_text(f"#!/bin/sh\n{waits}\n{writes}")
        writer.chmod(0o700)
        assert button.text() == "Write report" and button.isEnabled()
        button.click()
        assert "Writing" in button.text() and not button.isEnabled()
        let.touch()
        lab.until(button.isEnabled)
        assert button.text() == then
    (failed,) = (one.text for one in lab.session.log.lines if "no room" in one.text)
    assert folder.name in failed and "Write report, in Results" in failed


def test_name_tags_and_notes_are_edited_on_the_card(lab) -> None:
    window, folder = lab.window, lab.complete_run()  # 20 are listed, the newest first
    card = window.runs.card
    card.show_run(folder)
    lab.until(lambda: "complete" in card.texts["Log"].toPlainText())
    assert "KEPCO" in card.texts["Facts"].toPlainText()
    assert "levels" in card.texts["Settings"].toPlainText()
    card.title.setText("The good one")
    card.tags.setText("paper, fig 4")
    card.notes.setRowCount(0)
    card.add.click()
    card.notes.item(0, 0).setText("0.5")
    card.notes.item(0, 1).setText("here")
    card.save.click()
    said = read_remarks(folder)
    assert said.title == "The good one" and list(said.tags) == ["paper", "fig 4"]
    assert [(n.time, n.text) for n in said.notes] == [(0.5, "here")]
    runs = window.review.runs
    lab.until(lambda: "The good one" in [c.entry.title for c in runs.cards])


def press(lab, *keys: Qt.Key) -> None:
    for key in keys:
        QTest.keyClick(lab.app.focusWidget(), key)
        lab.app.processEvents()


def test_notes_are_taken_out_with_the_keyboard(lab) -> None:
    """A second Enter took out one more, and the last left the keyboard on nothing."""
    folder, card = lab.complete_run(), lab.window.runs.card
    for text in ("one", "two", "three"):
        add_note(folder, text)
    card.show_run(folder)
    notes, left = card.notes, ["one", "two", "three"]

    def standing() -> list[str]:
        return [notes.item(at, 1).text() for at in range(notes.rowCount())]

    assert standing() == left and notes.selectedItems(), "one sees which is chosen"
    press(lab, *[Qt.Key.Key_Tab] * 3)
    assert notes.hasFocus()
    press(lab, Qt.Key.Key_Down, Qt.Key.Key_Tab, Qt.Key.Key_Tab)
    assert card.remove.hasFocus()
    press(lab, Qt.Key.Key_Return, Qt.Key.Key_Return)
    assert standing() == ["one", "three"] and notes.hasFocus()
    assert notes.selectedItems()[0].text() == "three"
    press(lab, Qt.Key.Key_Delete, Qt.Key.Key_Delete)
    assert standing() == [] and card.add.hasFocus() and not card.remove.isEnabled()
    card.save.click()
    assert not read_remarks(folder).notes


def test_tab_leads_out_of_a_note_that_is_typed(lab) -> None:
    """From the last cell it went on to the first one, round and round."""
    card = lab.window.runs.card
    card.show_run(lab.complete_run())
    for keys, to in (
        ([Qt.Key.Key_Tab], card.add),
        ([Qt.Key.Key_Backtab] * 2, card.star),
    ):
        card.add.setFocus()
        press(lab, Qt.Key.Key_Space)
        QTest.keyClicks(lab.app.focusWidget(), "seen")
        press(lab, *keys)
        assert to.hasFocus() and card.notes.item(0, 1).text() == "seen"
        press(lab, Qt.Key.Key_Escape)
        card.show_run(card._folder)
        card.notes.setRowCount(0)
    card.hide()


def test_a_note_that_came_while_the_card_was_open_is_kept(lab) -> None:
    """As by the command line, or from a second window."""
    card, folder = lab.window.runs.card, lab.runs(1)[0]
    card.show_run(folder)
    card.notes.setRowCount(0)
    add_note(folder, "from elsewhere", 0.3)
    card.save.click()
    assert [n.text for n in read_remarks(folder).notes] == ["from elsewhere"]


def test_a_time_that_is_none_is_refused_on_the_card(lab) -> None:
    card, folder = lab.window.runs.card, lab.runs(1)[0]
    card.show_run(folder)
    card.notes.setRowCount(0)
    card.add.click()
    card.notes.item(0, 0).setText("soon")
    card.notes.item(0, 1).setText("here")
    card.save.click()
    assert card.isVisible() and "soon" in card.problem.text()
    card.hide()
    card.show_run(folder)
    assert card.notes.item(0, 0).text() == "soon", "it was dropped, and nobody told"
    assert card.problem.text().startswith("Not saved yet")
    add_note(folder, "by another hand")
    card.show_run(folder)
    assert card.notes.findItems("by another hand", Qt.MatchFlag.MatchExactly)
    assert not card.problem.text()
    card.hide()


def test_a_run_in_the_waste_basket_takes_the_notice_of_another_away(
    lab, monkeypatch
) -> None:
    runs, said = lab.window.runs, lab.window.centre.notice
    kept, gone = lab.folder / "kept", lab.folder / "gone"
    kept.mkdir(), gone.mkdir()
    for folder, moved in (kept, False), (gone, True):
        monkeypatch.setattr(QFile, "moveToTrash", lambda path, moved=moved: moved)
        runs._delete(folder)
        assert said.isHidden() is moved


def test_a_run_that_was_cut_short_is_recovered_in_the_window(lab) -> None:
    window, runs = lab.window, lab.window.review.runs
    lab.run()
    lab.until(lambda: lab.session.source.reach > 1.0)
    folder = lab.session.run.folder
    lab.until(lambda: stored(folder) > 1.0)  # disks have it later than windows
    cut = folder.with_name(folder.name + "_killed")
    shutil.copytree(folder, cut)  # nobody writes it any more
    lab.session.stop("enough")
    lab.until(lambda: lab.session.state is WindowState.READY)
    window.screen_.list_runs()
    lab.until(lambda: cut in [card.entry.folder for card in runs.cards])
    card = next(card for card in runs.cards if card.entry.folder == cut)
    assert card.entry.status == "cut short"
    QTest.mouseClick(card, Qt.MouseButton.LeftButton)
    runs.recover.click()
    lab.until(lambda: lab.session.opened == (cut.name,))
    with Run.load(cut) as run:
        assert run.status == "recovered" and run.duration > 0.5


def test_a_deleted_run_is_gone_from_the_list(lab, monkeypatch) -> None:
    window = lab.window
    source = lab.complete_run()
    copy = source.with_name(source.name + "_copy")
    shutil.copytree(source, copy)
    monkeypatch.setenv("XDG_DATA_HOME", str(lab.folder))
    window.screen_.list_runs()
    runs = window.review.runs
    lab.until(lambda: copy in [card.entry.folder for card in runs.cards])
    entry = next(card.entry for card in runs.cards if card.entry.folder == copy)
    window.runs.delete(entry)
    assert window.runs.confirm.isVisible() and copy.exists(), "asked first"
    window.runs.confirm.do.click()
    lab.until(lambda: copy not in [card.entry.folder for card in runs.cards])
    assert not copy.exists()
