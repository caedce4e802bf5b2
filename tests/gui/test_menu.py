"""The menu, what a user prefers, and what is at hand on a small screen."""

from pathlib import Path
from types import SimpleNamespace

import pytest
from PySide6.QtCore import QEvent, QPoint, QRect, QSettings, Qt
from PySide6.QtGui import QHelpEvent, QKeySequence, QShortcut
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QMenu, QToolTip

import tactile_lab
from gui.dialogs.preferring import PreferencesCard
from gui.habits import Habits
from gui.menu import GearMenu
from gui.parts import Combo
from gui.popup_menu import Menu
from gui.preferences import Preferences
from gui.state import WindowState

SIMULATED = Path(tactile_lab.__file__).parent / "scene" / "simulated_bench.toml"


@pytest.fixture
def kept(tmp_path: Path) -> QSettings:
    return QSettings(str(tmp_path / "settings.ini"), QSettings.Format.IniFormat)


def test_preferences_are_kept_from_one_start_to_the_next(
    app: QApplication, kept: QSettings, tmp_path: Path
) -> None:
    scene = tmp_path / "mine.toml"
    scene.touch()
    first = Preferences(kept)
    assert first.folder == Path("runs") and first.bench == "sim"
    assert first.wants("reports") and not first.wants("monitor")
    first.set(folder="/data/runs", monitor=True, reports=False)
    first.remember(str(scene))
    first.remember(str(tmp_path / "gone.toml"))
    kept.sync()
    second = Preferences(QSettings(kept.fileName(), QSettings.Format.IniFormat))
    assert second.folder == Path("/data/runs") and second.wants("monitor")
    assert not second.wants("reports") and not second.wants("sound")
    assert second.recent == [scene], "those that are still there"


def test_settings_act_at_once(lab, monkeypatch) -> None:
    window, session = lab.window, lab.session
    out = session.out
    window.actions_.show_preferences()
    card = window.findChild(PreferencesCard)
    assert card.isVisible()
    rings: list[bool] = []
    bell = SimpleNamespace(beep=lambda: rings.append(True))
    monkeypatch.setattr("gui.dialogs.preferring.QApplication", bell)
    for _ in range(2):
        card.switches["sound"].click()
    assert rings == [True], "as it is ticked: whether it can be heard"
    card.folder.setText(str(lab.folder / "elsewhere"))
    card.switches["reports"].setChecked(False)
    card.switches["lsl"].setChecked(True)
    file = lab.folder / "short.toml"
    for field, unfit, right, said in (
        (card.bench, str(lab.folder / "nothere.toml"), "sim", "nothere.toml"),
        (card.folder, str(file / "runs"), card.folder.text(), f"{file} is a file"),
    ):
        field.setText(unfit)
        card.save.click()
        assert card.isVisible() and said in card.problem.text()
        assert session.run.out == out, "nothing was saved"
        field.setText(right)
    card.save.click()
    assert session.run.out == lab.folder / "elsewhere" and not card.isVisible()
    assert session.run.publish
    window.preferences.set(folder=str(out), lsl=False, bench="")
    assert not session.run.publish
    assert session.out == out


def test_what_settings_name_is_found_from_any_working_folder(
    lab, tmp_path: Path, monkeypatch
) -> None:
    """Runs went into a folder "~", and the bench was gone at a start from elsewhere."""
    monkeypatch.setenv("HOME", str(tmp_path))
    monkeypatch.chdir(tmp_path)
    bench = tmp_path / "mine.toml"
    bench.write_text(SIMULATED.read_text())
    window, session = lab.window, lab.session
    out = session.out
    window.actions_.show_preferences()
    card = window.findChild(PreferencesCard)
    card.folder.setText("~/data")
    card.bench.setText("mine.toml")
    card.save.click()
    assert session.run.out == tmp_path / "data"
    assert window.preferences.chosen_bench == str(bench)
    window.preferences.set(folder=str(out), bench="")
    session.connect_bench("mine.toml")
    lab.until(lambda: session.state is WindowState.READY)
    assert window.preferences.bench == str(bench), "the one that answered last"
    session.connect_bench("sim")
    lab.until(lambda: session.state is WindowState.READY)


def test_no_report_is_written_for_tests_that_follow(lab) -> None:
    """Each preference that was set turned them on again for all of the process."""
    lab.window.preferences.set(sound=False)
    assert not lab.session.run.reports
    lab.window.preferences.set(reports=True)
    assert lab.session.run.reports
    lab.ready()
    assert not lab.session.run.reports
    lab.window.preferences.set(sound=False)
    assert not lab.session.run.reports


def test_the_menu_leaves_stop_uncovered(lab) -> None:
    """It lay over the lower edge of STOP."""
    lab.window.actions_.show_menu()
    menu = lab.window.findChild(GearMenu)
    stop = lab.window.header.stop
    assert menu.isVisible()
    assert menu.geometry().top() > stop.mapToGlobal(stop.rect().bottomLeft()).y()
    menu.close()


def test_a_menu_that_is_higher_than_the_screen_stays_one_column(lab) -> None:
    """At 860 x 540 it had two, and covered STOP with the second."""
    menu = QMenu(lab.window)
    for number in range(60):
        menu.addAction(f"entry {number}")
    menu.popup(lab.window.mapToGlobal(QPoint()))
    assert menu.sizeHint().height() >= menu.height()
    assert {menu.actionGeometry(one).left() for one in menu.actions()} == {
        menu.actionGeometry(menu.actions()[0]).left()
    }
    menu.close()
    menu.deleteLater()


def test_the_menu_leaves_stop_uncovered_where_the_screen_is_low(lab) -> None:
    header, before = lab.window.header, lab.window.geometry()
    lab.window.resize(860, 500)
    lab.window.move(0, lab.window.screen().availableGeometry().bottom() - 300)
    lab.app.processEvents()
    lab.window.actions_.show_menu()
    menu = lab.window.findChild(GearMenu)
    stop = QRect(header.stop.mapToGlobal(QPoint()), header.stop.size())
    covered = menu.geometry().intersects(stop)
    menu.close()
    lab.window.setGeometry(before)
    assert not covered


def test_a_folder_that_the_command_line_names_wins(lab, kept: QSettings) -> None:
    """Save moved the runs of a window that was started with --out."""
    window, session = lab.window, lab.session
    out, other = session.out, lab.folder / "chosen"
    wishes = Preferences(kept, out=out)
    habits = Habits(session, wishes, window.screen_, window.centre.stack)
    wishes.set(folder=str(other))
    assert session.out == out
    assert wishes.chosen_folder == other, "as the page shows it, and the next start has"
    habits.deleteLater()


def test_the_sensor_is_watched_where_that_is_preferred(lab) -> None:
    lab.window.preferences.set(folder=str(lab.session.out), monitor=True, reports=False)
    lab.session.connect_bench("sim")
    lab.until(lambda: lab.session.monitor.alive)
    lab.window.preferences.set(monitor=False)
    lab.session.show_monitor(False)
    lab.until(lambda: not lab.session.monitor.alive)


def entries(menu: QMenu) -> dict[str, str]:
    parts = (one.text().partition("\t") for one in menu.actions() if one.text())
    return {words: keys for words, _, keys in parts}


def test_the_menu_names_shortcuts_that_exist_and_what_was_opened_last(lab) -> None:
    window = lab.window
    window.screen_.open_scene(str(lab.folder / "short.toml"))
    lab.runs(1)
    window.screen_.list_runs()
    lab.until(lambda: window.review.runs.newest(1))
    window.actions_.show_menu()
    (menu,) = window.findChildren(GearMenu)
    found = entries(menu)
    bound = {one.key().toString() for one in window.findChildren(QShortcut)}
    for words, keys in found.items():
        if keys and keys != "?":
            assert QKeySequence(keys).toString() in bound, words
    submenus = {one.text(): one.menu() for one in menu.actions() if one.menu()}
    assert "short" in submenus["Recent scenes"].actions()[0].text()
    assert submenus["Recent runs"].actions()
    assert "About Tactile Lab" in found
    menu.close()


def test_the_menu_offers_nothing_that_a_run_forbids(lab) -> None:
    def possible() -> dict[str, bool]:
        lab.window.actions_.show_menu()
        menu = lab.window.findChildren(GearMenu)[-1]
        found = {one.text(): one.isEnabled() for one in menu.actions()}
        menu.close()
        return {name: found[name] for name in ("Use simulated bench", "Disconnect")}

    assert possible() == {"Use simulated bench": True, "Disconnect": True}
    lab.run()
    assert possible() == {"Use simulated bench": False, "Disconnect": False}


def test_cards_over_each_other_darken_the_window_once(lab) -> None:
    window = lab.window
    window.actions_.show_help()
    corner = QPoint(20, window.height() - 20)

    def colour() -> str:
        lab.app.processEvents()
        return window.grab().toImage().pixelColor(corner).name()

    one = colour()
    window.actions_.show_preferences()
    assert colour() == one


def test_single_keys_do_nothing_below_a_card(lab) -> None:
    window = lab.window
    before = window.centre.tools.zoom.isChecked()
    window.actions_.show_help()
    window.page.setFocus()
    QTest.keyClick(window, Qt.Key.Key_Z)
    assert window.centre.tools.zoom.isChecked() is before


def test_a_folded_panel_leaves_a_button_that_brings_it_back(lab) -> None:
    window = lab.window
    window.resize(1280, 800)
    left, right = window.header.folds
    assert window.review.isHidden() and not right.isHidden() and left.isHidden()
    right.click()
    assert not window.review.isHidden() and right.isHidden()
    window._folds = dict.fromkeys(window._folds)
    window.resize(1720, 1080)
    window.review.show()


def test_the_title_names_run_and_bench(lab) -> None:
    lab.runs(1)
    title = lab.window.windowTitle()
    assert "simulated bench" in title and title.endswith("Tactile Lab")


def test_a_run_that_begins_beside_a_record_is_named(lab) -> None:
    lab.runs(1)
    lab.window.screen_.open_run(lab.complete[0])
    lab.until(lambda: lab.window.screen_.run is not None)
    lab.run()
    lab.app.processEvents()
    assert lab.session.run.folder.name in lab.window.windowTitle()


def test_a_list_opens_with_all_its_rows(lab) -> None:
    boxes = [lab.window.setup.picker]
    boxes += [b for b in lab.window.setup.form.findChildren(Combo) if b.count() > 1]
    for box in boxes:
        box.showPopup()
        lab.app.processEvents()
        view = box.view()
        assert view.verticalScrollBar().maximum() == 0, box.accessibleName()
        # no room for Qt's arrows: they hid a row at every other opening on X11
        assert view.geometry() == view.window().rect()
        box.hidePopup()


def test_long_tool_tips_are_broken_into_lines(lab) -> None:
    stop = lab.window.header.stop
    words = "a word " * 30
    before = stop.toolTip()
    stop.setToolTip(words)
    at = stop.mapToGlobal(QPoint(5, 5))
    QApplication.sendEvent(stop, QHelpEvent(QEvent.Type.ToolTip, QPoint(5, 5), at))
    assert QToolTip.text().startswith("<p>")
    QToolTip.hideText()
    stop.setToolTip(before)


def test_the_clock_goes_on_without_samples(lab) -> None:
    session = lab.session
    scene = lab.folder / "force_only.toml"
    scene.write_text(
        '[protocol]\nname = "pulses"\nlevels = ["120 mN"]\nhold = "3000 s"\n'
        '[record]\nsignals = ["force"]\n'
    )
    window = lab.window
    window.screen_.open_scene(str(scene))
    window.setup.start_when_planned()
    lab.until(lambda: session.state is WindowState.RUNNING)
    lab.until(lambda: session.run.elapsed > 2.0)


def test_a_line_that_keys_choose_is_in_sight_though_the_menu_scrolls(lab) -> None:
    """Up chose the last line, Quit, of which nothing was to be seen."""
    menu = Menu(lab.window)
    for number in range(200):
        menu.addAction(f"Line {number}")
    menu.popup(QPoint(0, 0))
    lab.until(menu.isVisible)
    assert not menu.rect().contains(menu.actionGeometry(menu.actions()[-1]))
    QTest.keyClick(menu, Qt.Key.Key_Up)
    assert menu.activeAction() is menu.actions()[-1]
    assert menu.rect().contains(menu.actionGeometry(menu.actions()[-1]))
    menu.close()
    menu.deleteLater()
