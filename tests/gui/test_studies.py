"""Studies in the window: finished ones, and one that is computed meanwhile."""

from pathlib import Path

import pytest
from PySide6.QtCore import QPointF, Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QWidget

from gui.dialogs.studies import StudiesCard
from gui.look.theme import Theme
from tactile_lab.errors import RunFolderError
from tactile_lab.scene.load import load
from tactile_lab.studies.carry_out import StudyProgress, carry_out
from tactile_lab.studies.live import look_at, studies_in
from tactile_lab.studies.page import write_page
from tactile_lab.studies.study import load_study

ASKED = {
    "title": "Threshold against V_GS",
    "scene": "demo",
    "keep": ["critical_force"],
    "axis": [
        {"key": "sensor.V_GS", "values": "1.36 V : 1.44 V : 10 mV"},
        {"key": "sensor.R1", "values": ["9 MOhm", "10 MOhm"]},
    ],
}


def test_figures_come_with_the_points_and_stay(lab, tmp_path: Path) -> None:
    asked, out = load_study(ASKED, "onset"), tmp_path / "studies"
    card = StudiesCard(lab.window, Theme("light"))
    card.show_studies((out,))
    assert "No studies yet" in card.text.text()
    assert f"--out {out} makes one" in card.text.text()
    seen: list[str] = []

    def tell(progress: StudyProgress) -> None:
        card.refresh()
        if card.choice.count():
            seen.append(f"{card.state.text()}: {card.text.text()}")

    found = carry_out(asked, out, count=1, tell=tell)
    assert any("Running" in one and "of 18 points are known" in one for one in seen)
    write_page(found, out / "onset")
    card.refresh()
    assert card.choice.currentText() == "onset" and card.state.text() == "At rest"
    assert "18 points of demo" in card.text.text()
    names = [one.plot.name for one in card.figures if one.plot is not None]
    assert names == ["map", "response_0", "response_1"]
    card._rows.activate()
    assert card.tables.y() > card.figures[-1].y(), "they stay where they came"
    assert "MΩ" in card.tables.text() and "Ohm" not in card.tables.text()
    assert card.page.isEnabled()
    first = card.points.itemText(0)
    room = card.points.maximumWidth() - 40
    wide = card.points.fontMetrics().horizontalAdvance(first)
    assert wide <= room, first
    (out / "onset" / "results.json").write_text("{")
    card.refresh()
    assert "holds no study that can be read" in card.text.text()
    card.hide()
    card.deleteLater()


def test_a_click_on_a_cell_puts_its_scene_into_the_form(lab, tmp_path: Path) -> None:
    resistors = {"key": "sensor.R1", "values": ["9 MOhm", "10 MOhm", "-1 MOhm"]}
    asked = load_study({**ASKED, "axis": [ASKED["axis"][0], resistors]}, "onset")
    write_page(carry_out(asked, tmp_path, count=1), tmp_path / "onset")
    card = StudiesCard(lab.window, Theme("light"))
    opened: list[Path] = []
    card.opened.connect(opened.append)
    card.show_studies((tmp_path,))
    lab.app.processEvents()
    figure = card.figures[0]

    def click(V_GS: float, megohms: float, done) -> None:
        """As soon as the figure has its place."""
        box = figure.panels[0].box

        def clicked() -> bool:
            at = figure.mapFromScene(box.mapViewToScene(QPointF(V_GS, megohms)))
            if card.isVisible():
                QTest.mouseClick(figure.viewport(), Qt.MouseButton.LeftButton, pos=at)
            return done()

        lab.until(clicked)

    assert figure.plot is not None and figure.plot.name == "map"
    card.points.setCurrentIndex(card.points.findData(13))  # with the keyboard alone
    assert "V_GS = 1.4 V" in card.points.currentText()
    card.point.click()
    assert opened.pop().name and not card.isVisible()
    card.show_studies((tmp_path,))
    lab.app.processEvents()
    assert "V_GS = 1.4 V, sensor.R1 = 10 MΩ" in figure.tell(13)
    click(1.38, -1.0, lambda: "R1 = -1e+06 Ohm must lie betw" in card.hint.text())
    assert card.isVisible() and not opened
    click(1.401, 10.1, lambda: opened)
    assert not card.isVisible()
    (file,) = opened
    circuit = load(file).circuit
    assert (circuit.V_GS, circuit.R1) == (1.4, 10e6)
    lab.window.screen_.open_point(file)
    assert lab.window.setup.subject.path == str(file)
    card.deleteLater()


def test_it_can_be_made_over_a_window_that_was_closed(app, tmp_path: Path) -> None:
    window = QWidget()
    window.show()
    window.close()
    card = StudiesCard(window, Theme("light"))
    card.show_studies((tmp_path,))
    assert "No studies yet" in card.text.text()
    window.deleteLater()


def test_one_that_was_killed_says_how_to_go_on(tmp_path: Path) -> None:
    class KilledError(Exception):
        pass

    done = 0

    def tell(progress: StudyProgress) -> None:
        nonlocal done
        done = progress.done
        if done > 1:
            raise KilledError

    with pytest.raises(KilledError):
        carry_out(load_study(ASKED, "onset"), tmp_path, count=1, tell=tell)
    (folder,) = studies_in(tmp_path)
    seen = look_at(folder)
    assert f"{done} of 18 points are known" in seen.sentences[0]
    assert "start it again" in seen.sentences[-1]
    with pytest.raises(RunFolderError):
        look_at(tmp_path)


def test_the_chosen_study_stays_chosen_as_it_ends(lab, tmp_path: Path) -> None:
    """Between its last point and its page it was in no list, and another was shown."""
    out = tmp_path / "studies"
    for name in ("first", "second"):
        write_page(carry_out(load_study(ASKED, name), out, count=1), out / name)
    again = load_study({**ASKED, "keep": ["critical_force", "spike_count"]}, "first")
    (out / "first" / "results.json").unlink()
    card = StudiesCard(lab.window, Theme("light"))
    card.show_studies((out,))
    heard: list[str] = []

    def tell(_: StudyProgress) -> None:
        card.refresh()
        if "first" in [card.choice.itemText(n) for n in range(card.choice.count())]:
            card.choice.setCurrentText("first")
            heard.append(card.state.text())

    found = carry_out(again, out, count=1, tell=tell)
    assert "Running" in heard
    card.refresh()
    assert card.choice.currentText() == "first"
    assert card.text.text().splitlines()[-1] == "18 of 18 points are known."
    write_page(found, out / "first")
    card.refresh()
    assert card.choice.currentText() == "first" and card.page.isEnabled()
    assert "18 points of demo" in card.text.text()
    card.hide()
    card.deleteLater()


def test_points_that_failed_alike_can_be_told_apart_in_their_list(
    lab, tmp_path: Path
) -> None:
    """What differs was left out of the middle, in favour of the end of the reason."""
    keep = {"third": "spikes[np.array([9999])]"}
    asked = load_study({**ASKED, "keep": keep, "axis": ASKED["axis"][:1]}, "failing")
    write_page(carry_out(asked, tmp_path, count=1), tmp_path / "failing")
    card = StudiesCard(lab.window, Theme("light"))
    card.show_studies((tmp_path,))
    view, texts = card.points.view(), range(card.points.count())
    assert "IndexError" in card.points.itemText(0)
    shown = {
        view.fontMetrics().elidedText(
            card.points.itemText(n), view.textElideMode(), card.points.maximumWidth()
        )
        for n in texts
    }
    assert len(shown) == len(texts) == 9
    role = Qt.ItemDataRole.ToolTipRole
    assert card.points.itemData(8, role) == card.points.itemText(8)
    card.hide()
    card.deleteLater()


def test_another_study_is_shown_from_its_beginning(lab, tmp_path: Path) -> None:
    for name in ("first", "second"):
        write_page(
            carry_out(load_study(ASKED, name), tmp_path, count=1), tmp_path / name
        )
    card = StudiesCard(lab.window, Theme("light"))
    card.show_studies((tmp_path,))
    bar = card._area.verticalScrollBar()
    lab.until(lambda: bar.maximum() > 0)
    bar.setValue(bar.maximum())
    card.choice.setCurrentIndex(1 - card.choice.currentIndex())
    assert bar.value() == 0, "what it says stands there"
    card.hide()
    card.deleteLater()


def test_what_axes_share_is_told_in_the_window_too(lab, tmp_path: Path) -> None:
    """A study of spread said how many points it had, over an empty card."""
    asked = load_study(
        {
            "title": "Spread <of parts>",
            "scene": "demo",
            "keep": ["critical_force"],
            "draw": {"points": 8, "method": "indices"},
            "axis": [
                {"key": "sensor.R1", "normal": "1 %"},
                {"key": "sensor.V_GS", "normal": "3 mV"},
            ],
        },
        "spread",
    )
    out = tmp_path / "studies"
    _, said = write_page(carry_out(asked, out, count=1), out / "spread")
    card = StudiesCard(lab.window, Theme("light"))
    card.show_studies((out,))
    (table,) = look_at(out / "spread").tables
    assert (table,) == said.tables and not card.figures
    told = card.tables.text()
    assert card.tables.isVisibleTo(card) and "Sobol indices of critical_force" in told
    assert "sensor.V_GS" in told and table.rows[1][-1] in told and table.note in told
    card.hide()
    card.deleteLater()
