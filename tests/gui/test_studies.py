"""Studies in the window: finished ones, and one that is computed meanwhile."""

from pathlib import Path

import pytest

from gui.dialogs.studies import StudiesCard
from gui.look.theme import Theme
from tactile_lab.errors import RunFolderError
from tactile_lab.studies.carry_out import Progress, carry_out
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
    seen: list[str] = []

    def tell(progress: Progress) -> None:
        card.refresh()
        if card.choice.count():
            seen.append(f"{card.state.text()}: {card.text.text()}")

    found = carry_out(asked, out, count=1, tell=tell)
    assert any("Running" in one and "of 18 points are known" in one for one in seen)
    write_page(found, out / "onset")
    card.refresh()
    assert card.choice.currentText() == "onset" and card.state.text() == "At rest"
    assert "18 points of demo" in card.text.text()
    assert len([one for one in card.figures if one.plot is not None]) == 2
    assert card.page.isEnabled()
    (out / "onset" / "results.json").write_text("{")
    card.refresh()
    assert "holds no study that can be read" in card.text.text()
    card.hide()
    card.deleteLater()


def test_one_that_was_killed_says_how_to_go_on(tmp_path: Path) -> None:
    class KilledError(Exception):
        pass

    def tell(progress: Progress) -> None:
        if progress.done > 1:
            raise KilledError

    with pytest.raises(KilledError):
        carry_out(load_study(ASKED, "onset"), tmp_path, count=1, tell=tell)
    (folder,) = studies_in(tmp_path)
    assert "start it again" in look_at(folder).sentences[-1]
    with pytest.raises(RunFolderError):
        look_at(tmp_path)
