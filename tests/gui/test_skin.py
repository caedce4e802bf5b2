"""An array of sensors in a window of its own."""

import threading

import numpy as np
import pytest
from click.testing import CliRunner
from PySide6.QtCore import Qt
from PySide6.QtGui import QWindow
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QFileDialog
from shiboken6 import isValid

from gui.skin.computing import SkinComputation
from gui.skin.film import DOTS, Dots, pixels
from gui.skin.window import SkinWindow, open_skin
from tactile_lab.commands.skin import command
from tactile_lab.errors import RunFolderError, SceneError
from tactile_lab.skin.events import Events
from tactile_lab.skin.press import highest, press
from tactile_lab.skin.skin import load_skin

BALL = """
title = "A ball"
duration = "0.4 s"
[array]
grid = [5, 4]
stuck = [3]
stuck_rate = "100 Hz"
[[stimulus]]
kind = "sphere"
force = "3 N"
start = "0.1 s"
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    path = tmp_path_factory.mktemp("skin")
    (path / "ball.toml").write_text(BALL)
    return path


@pytest.fixture(scope="module")
def events(folder):
    skin = load_skin(folder / "ball.toml")
    press(skin, folder / "pressed")
    return Events.read(folder / "pressed")


def shown(lab, path, folder):
    window = open_skin(path, folder / "skins")(lab.window.panels.theme, None)
    window.show()
    lab.until(lambda: window.film is not None)
    return window


def test_trains_come_while_it_is_computed_and_are_played_after(lab, folder, events):
    skin = load_skin(folder / "ball.toml")
    computing = SkinComputation(skin, folder / "again")
    computing.thread.join()
    told = computing.told()
    assert [type(one).__name__ for one in told] == ["TrainsFound", "Film"]
    trains, film = told
    assert trains.first == 0
    np.testing.assert_array_equal(trains.count, events.count)
    assert film.dots.seen == events.time.shape[0]


def test_space_plays_nothing_while_it_is_computed(lab, folder, events):
    """The button showed "pause", and the film began by itself later."""
    window = open_skin(folder / "ball.toml", folder / "spaced")(
        lab.window.panels.theme, None
    )
    window._timer.stop()  # it hears of nothing that is computed meanwhile
    window.show()
    lab.until(window.isActiveWindow)
    QTest.keyClick(window.windowHandle(), Qt.Key.Key_Space)
    assert not window.play.isChecked()
    window._timer.start()
    lab.until(lambda: window.film is not None)
    QTest.keyClick(window.windowHandle(), Qt.Key.Key_Space)
    assert window.play.isChecked()
    window.close()


def test_the_map_shows_the_spikes_before_the_moment(lab, folder, events):
    window = shown(lab, folder / "pressed", folder)
    film = window.film
    for at in (film.stretch, 0.15, 0.25, 0.4):
        window.show_time(at)
        time, taxel = events.time[:], events.taxel[:]
        inside = (time >= at - film.stretch) & (time < at)
        counts = np.bincount(taxel[inside], minlength=20)
        image = window.map.picture.image
        which, _ = pixels(events.places, 1e-3)
        rates = [np.nanmax(np.where(which == k, image, np.nan)) for k in range(20)]
        np.testing.assert_allclose(rates, counts / film.stretch)
        assert window.raster.now.value() == at
    assert window.raster.dots.data.size == events.time.shape[0] > 40
    assert f"{events.time.shape[0]} spikes" in window.numbers.toolTip() or (
        f"{events.time.shape[0]} spikes" in window.numbers.text()
    )
    window.close()


@pytest.mark.parametrize("theme", ["light", "dark"])
def test_dead_and_stuck_taxels_are_marked_and_told(lab, tmp_path, theme):
    asked = BALL.replace("stuck = [3]", "stuck = [3]\ndead = [7, 12]")
    asked = asked.replace("100 Hz", "1 kHz")
    (tmp_path / "ball.toml").write_text(asked)
    lab.window.theme.choose(theme)
    went: list[QWindow] = []
    lab.app.focusWindowChanged.connect(went.append)
    try:
        window = shown(lab, tmp_path / "ball.toml", tmp_path)
        assert {*went} == {window.windowHandle()}, "no part of it is a window before"
        assert window.marks.text() == (
            "✕ dead (2) · ▢ stuck (1), left out of full colour"
        )
        places = 1e3 * window._skin.array.places
        crossed = np.column_stack(window.map.cross.getData())
        np.testing.assert_allclose(crossed, places[[7, 12]])
        for frame in window.map.frames:
            np.testing.assert_allclose(np.column_stack(frame.getData()), places[[3]])
        assert window.film.most < 1000 * window.film.stretch, "the stuck one's"
        window.show_time(0.3)
        image, which = window.map.picture.image, window.map._which
        assert np.isnan(image[(which == 7) | (which == 12)]).all()
        assert not np.isnan(image[which == 3]).any()
        window.close()
    finally:
        lab.app.focusWindowChanged.disconnect(went.append)
        lab.window.theme.choose("light")


def test_nothing_is_said_of_marks_where_there_are_none(lab, tmp_path):
    (tmp_path / "ball.toml").write_text(BALL.replace("stuck = [3]", ""))
    window = shown(lab, tmp_path / "ball.toml", tmp_path)
    assert window.marks.isHidden()
    window.close()


def test_play_moves_on_to_the_end_and_stops_there(lab, folder, events):
    window = shown(lab, folder / "pressed", folder)
    window.speed.setCurrentText("10 × faster")
    QTest.keyClick(window, Qt.Key.Key_Space)
    lab.until(lambda: not window.play.isChecked())
    assert window.slider.value() == window.slider.maximum()
    window.slider.setValue(0)
    assert window.when.text().startswith("0.000 of 0.400 s")
    window.close()


def test_what_cannot_be_shown_is_refused_or_told(lab, folder, tmp_path):
    theme = lab.window.panels.theme
    with pytest.raises(RunFolderError, match="does not exist"):
        open_skin(tmp_path / "none.toml", tmp_path)
    with pytest.raises(RunFolderError, match="holds no events"):
        open_skin(tmp_path, tmp_path)
    (tmp_path / "bad.toml").write_text(BALL.replace("[5, 4]", "[5, 0]"))
    with pytest.raises(SceneError):
        open_skin(tmp_path / "bad.toml", tmp_path)
    (tmp_path / "file").write_text("in the way")
    window = open_skin(folder / "ball.toml", tmp_path / "file")(theme, None)
    window.show()
    lab.until(window.warning.isVisible)
    assert "file" in window.warning.text()
    window.close()


def test_the_verb_that_cannot_show_it_ends_with_2(lab, tmp_path):
    none = [str(tmp_path / "none.toml"), "--window"]
    assert CliRunner().invoke(command, none).exit_code == 2
    assert CliRunner().invoke(command, [*none, "--json"]).exit_code == 2


def test_closing_the_window_ends_the_computing(folder, tmp_path):
    skin = load_skin(folder / "ball.toml")
    computing = SkinComputation(skin, tmp_path / "left")
    computing.leave()
    computing.thread.join()
    told = [type(one).__name__ for one in computing.told()]
    assert told in ([], ["TrainsFound", "Film"])  # it may have been done already


def test_a_closed_window_is_no_longer_dressed(lab, folder, events):
    window = shown(lab, folder / "ball.toml", folder)
    window.close()
    lab.until(lambda: not isValid(window))
    theme = lab.window.panels.theme
    theme.choose("dark")  # what a slot raises fails the test
    theme.choose("light")


def test_the_menu_opens_it_and_tells_what_prevents_it(lab, folder, tmp_path):
    actions = lab.window.actions_
    actions.ask_skin()
    (dialog,) = lab.window.findChildren(QFileDialog)
    dialog.close()
    actions.open_skin(tmp_path / "none.toml")
    lab.until(lambda: "does not exist" in lab.session.log.lines[-1].text)
    notice = lab.window.centre.notice
    assert notice.isVisible(), "a low window shows no log, and nothing happened there"


def test_stop_does_not_wait_while_a_skin_is_read(lab, folder, monkeypatch):
    """The kernel is compiled then, on a new computer for 20 s."""
    threads = []

    def noted(skin):
        threads.append(threading.current_thread())
        return highest(skin)

    monkeypatch.setattr("tactile_lab.skin.press.highest", noted)
    lab.window.actions_.open_skin(folder / "ball.toml")
    lab.until(lambda: lab.window.findChildren(SkinWindow))
    stops = lab.window.panels.stops
    for window in lab.window.findChildren(SkinWindow):
        room = window.screen().availableSize()
        assert window.size().boundedTo(room) == window.size(), "no part off the screen"
        (stop,) = (one for one in stops if one.window() is window)
        assert stop.isVisible(), "the window may cover that of the main one"
        lab.until(window.isActiveWindow)
        assert not stop.hasFocus(), "Space is for playing"
        lab.until(lambda stop=stop: stop.words == stops[0].words)
        window.close()
    assert len(stops) == 1
    assert threads and threading.main_thread() not in threads


def test_dots_are_thinned_evenly():
    dots, time = Dots(), np.arange(3.0 * DOTS)
    for part in np.array_split(time, 7):
        dots.add(part, part.astype(int))
    kept, taxel = dots.points
    assert dots.seen == time.size and kept.size <= DOTS
    np.testing.assert_array_equal(kept, time[:: dots.every])
    np.testing.assert_array_equal(taxel, kept)


def test_every_taxel_has_its_pixels_where_it_lies():
    places = np.array([[0.0, 0.0], [2e-3, 0.0], [1e-3, 1.8e-3]])
    which, (left, low, wide, high) = pixels(places, 1e-3)
    step = wide / which.shape[0]
    assert step == pytest.approx(high / which.shape[1])
    for taxel, place in enumerate(places):
        at = np.argwhere(which == taxel).mean(axis=0) + 0.5
        np.testing.assert_allclose((left, low) + at * step, place, atol=step)
    assert (which < 0).any()
