"""Cards and bars in a window as small as a screen of 1280 x 720 at 150 % leaves."""

from dataclasses import replace
from functools import partial
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from PySide6.QtCore import QPoint, QSize, Qt
from PySide6.QtWidgets import (
    QAbstractButton,
    QLabel,
    QLineEdit,
    QPushButton,
    QScrollArea,
    QWidget,
)

from gui.dialogs.connect import Connect
from gui.dialogs.help import Help
from gui.dialogs.preferring import PreferencesCard
from gui.dialogs.studies import StudiesCard
from gui.lanes.tools import Tools
from gui.look.theme import Theme
from gui.record.monitor_bar import MonitorBar
from gui.record.progress import ProgressStrip
from gui.review.noise_view import NoiseView
from gui.screen.centre import EmptyCard
from gui.screen.compare_bar import CompareBar
from gui.state import Snapshot
from gui.tab_order import reach
from gui.within_reach import FRAME
from tactile_lab.analysis.noise import noise
from tactile_lab.engine.sensor import SensorState

SMALL, USUAL = QSize(853, 480) - FRAME, QSize(1720, 1080)

BAR = 480
"""Width of the lanes in such a window beside the form, px."""


def cut(root: QWidget) -> list[str]:
    """What cannot be read, or pressed, in whole."""
    found = []
    for one in root.findChildren(QWidget):
        if isinstance(one, QScrollArea) and one.isVisible():
            if one.widget().width() > one.viewport().width():
                found.append(f"{one.widget().width()} px in {one.viewport().width()}")
            continue
        if not one.isVisible() or not isinstance(
            one, QAbstractButton | QLabel | QLineEdit
        ):
            continue
        least = one.minimumSizeHint()
        if isinstance(one, QLabel) and one.wordWrap():
            least = QSize(0, one.heightForWidth(one.width()))
        parent = one.parentWidget().rect()
        small = one.width() < least.width() or one.height() < least.height()
        if small or not parent.contains(one.geometry()):
            name = one.accessibleName() or one.text()
            found.append(f"{name}: {one.geometry()} of {least} in {parent}")
    return found


@pytest.fixture
def small(lab):
    lab.window.resize(SMALL)
    lab.app.processEvents()
    yield lab.window
    lab.window.resize(USUAL)


def test_every_card_fits(lab, small) -> None:
    acts, folder = small.actions_, lab.runs(1)[0]
    for kind, show in (
        (PreferencesCard, acts.show_preferences),
        *((Help, lambda page=page: acts.show_help(page=page)) for page in range(3)),
        (StudiesCard, acts.show_studies),
        (Connect, acts.connect_dialog),
        (type(small.runs.card), lambda: small.runs.card.show_run(folder)),
    ):
        show()
        lab.app.processEvents()
        card = small.findChild(kind)
        assert card.rect().contains(card.card.geometry())
        least = card.card.minimumSizeHint().height()
        assert least <= card.card.height(), kind
        assert cut(card.card) == [], kind
        card.hide()


def test_the_tools_fit_between_both_panels(lab, small) -> None:
    small.resize(QSize(1280, 800) - FRAME)
    small.fold(small.review, False)
    lab.app.processEvents()
    tools = small.centre.tools
    words = tools.widths.group.buttons()
    assert all(one.width() >= one.minimumSizeHint().width() for one in words)
    assert tools.fit.isVisible(), "no more is left out than needs to be"
    small.resize(1180, 720)
    small.fold(small.setup, False)
    lab.app.processEvents()
    note, hint = small.centre.log.note, "Note on the run in progress …  (N)"
    assert note.width() >= note.fontMetrics().horizontalAdvance(hint) + 26
    small._folds = dict.fromkeys(small._folds)  # nobody has folded one by hand


@pytest.fixture
def host(app):
    """A place for a bar; a window of its own would be as wide as it wants to be."""
    made = QWidget()
    made.resize(BAR, 120)
    made.show()
    yield made
    made.close()


def test_the_tools_that_fit_are_there_from_the_start(app, host, stack) -> None:
    """They were left out for the words beside others, which are not shown there."""
    host.resize(646, 60)
    tools = Tools(stack, stack.view, Theme("light"))
    tools.setParent(host)
    tools.setGeometry(0, 0, 646, 50)
    tools.show()
    for one in (tools.fit, tools.zoom, tools.export, tools.help):
        assert one.isVisible(), one.accessibleName()


def test_what_is_said_of_a_run_widens_no_column(app) -> None:
    """The steps of a comparison, named with all it differs in, took room of another."""
    strip = ProgressStrip(Theme("light"))
    words = "Steps of ● 21:19:41 sine_sweep · amplitude 50 mN; bias 0 N; cycles 2"
    strip.show_run(Snapshot(), [], 5.0, 5.0, None, words)
    assert strip.minimumSizeHint().width() < 200
    assert strip.text.startswith(words), "whole for a screen reader"


def lay(app, bar: QWidget) -> None:
    """Give a bar the width that there is, and the height it then needs."""
    bar.show()
    for _ in range(2):
        bar.setGeometry(0, 0, BAR, bar.sizeHint().height())
        app.processEvents()


def test_the_bar_of_the_monitor_fits(app, host) -> None:
    bar = MonitorBar()
    bar.setParent(host)
    known = SensorState(3.981, 4.346, 1.480, 7.25, held=60.0, shortest_interval=1.4e-3)
    missed, fast = replace(known, counted=False), replace(known, rate=19_600.0)
    for state, rate in ((known, "7.25 Hz"), (missed, "—"), (fast, "—")):
        bar.show_sensor(state, recording=False)
        lay(app, bar)
        assert cut(bar) == [] and bar.record.isVisible()
        assert f"Rate {rate}" in bar.words


def test_the_bar_of_a_comparison_fits(lab, host) -> None:
    centre = lab.window.centre
    bar = CompareBar(centre.stack, centre.view, lab.window.theme)
    bar.setParent(host)
    runs = [
        SimpleNamespace(name=f"14:03:5{k} demo", source=SimpleNamespace(path=Path()))
        for k in range(3)
    ]
    bar.show_comparison(SimpleNamespace(members=runs))
    lay(lab.app, bar)
    assert cut(bar) == []


@pytest.mark.parametrize("room", [(BAR, 170), (BAR, 600), (1100, 700)])
def test_the_card_of_the_empty_state_fits(app, room: tuple[int, int]) -> None:
    below = QWidget()
    width, height = room
    below.resize(width, height + 60)
    whole_run = QWidget(below)
    whole_run.setGeometry(0, height, width, 60)
    card = EmptyCard(below, whole_run, Theme("light"))
    card.show_recent([("Pulses · today 14:03 · complete", Path())] * 4)
    below.show()
    card.place()
    app.processEvents()
    assert below.rect().contains(card.geometry())
    assert not card.geometry().intersects(whole_run.geometry())
    assert cut(card) == [] and card.simulated.isVisible()
    below.close()


def test_the_card_of_the_empty_state_grows_with_what_it_offers(app) -> None:
    """Runs are listed after the window has appeared."""
    below = QWidget()
    below.resize(930, 440)
    card = EmptyCard(below, QWidget(below), Theme("light"))
    below.show()
    card.place()
    app.processEvents()
    card.show_recent([("Pulses · today 14:03 · complete", Path())])
    app.processEvents()
    (recent,) = (one for one in card.findChildren(QPushButton) if "14:03" in one.text())
    assert recent.isVisible() and cut(card) == []
    below.close()


def test_what_the_plan_warns_of_is_seen_below_a_long_form(lab, small, tmp_path) -> None:
    """It stood below the last field: who did not scroll down was told nothing."""
    scene = tmp_path / "sparse.toml"
    scene.write_text(
        '[protocol]\nname = "pulses"\n[record]\nsample_rate = "100 kS/s"\n'
    )
    window = lab.window
    window.screen_.open_scene(str(scene))
    lab.session.plan.expectation = None
    lab.until(lambda: lab.session.plan.expectation is not None)
    told = window.setup.warnings
    assert "misses about" in told.text()
    lab.app.processEvents()
    assert told.visibleRegion().boundingRect() == told.rect(), "all of it is in sight"
    assert cut(window.setup) == []


def squeezed(panel: QWidget) -> list[str]:
    """Parts of a panel that are lower than they can be, or lie over each other."""
    kind = Qt.FindChildOption.FindDirectChildrenOnly
    parts = [
        one for one in panel.findChildren(QWidget, options=kind) if one.isVisible()
    ]
    found = []
    for one in parts:
        least = one.minimumSizeHint().height()
        if isinstance(one, QLabel) and one.wordWrap():
            least = one.heightForWidth(one.width())
        others = [x for x in parts if x.geometry().intersects(one.geometry())]
        if one.height() < least or others != [one]:
            found.append(f"{type(one).__name__} {one.geometry()}, least {least}")
    return found


def comes_into_sight(one: QWidget) -> bool:
    """Whether all of it is seen once it has the keyboard."""
    reach(one)
    return one.visibleRegion().boundingRect() == one.rect()


def test_what_waits_leaves_form_and_buttons_whole(lab, small, tmp_path) -> None:
    """The queue stood over fields and buttons, and they over each other."""
    window, session = lab.window, lab.session
    setup, queue = window.setup, window.setup.queue
    scene = tmp_path / "sparse.toml"
    scene.write_text(
        '[protocol]\nname = "pulses"\n[record]\nsample_rate = "100 kS/s"\n'
    )
    window.screen_.open_scene(str(scene))
    session.plan.expectation = None
    lab.until(lambda: session.plan.expectation is not None)
    for _ in range(3):
        setup.enqueue()
    for size in (SMALL, QSize(1280, 800) / 1.5 - FRAME):
        window.resize(size)
        for edits in (False, True):
            if edits:
                setup.edit(session.queue.items[0])
            lab.until(setup.warnings.isVisible)
            lab.until(lambda: squeezed(setup) + squeezed(setup.form) == [], longest=5)
            for one in (*queue.cards, queue.resume, setup.form.fields[0].focusProxy()):
                lab.until(partial(comes_into_sight, one), longest=5)
        setup.cancel()
    window.resize(USUAL)
    lab.app.processEvents()
    assert queue.mapTo(setup, QPoint()).y() > setup.form.mapTo(setup, QPoint()).y()


def test_all_lines_of_the_mains_can_be_read(app) -> None:
    """What is said of them stood over the plot, and its end below the panel."""
    time = np.arange(0.0, 4.0, 1e-4)
    hum = [np.sin(2 * np.pi * 50 * n * time) / n for n in range(1, 11)]
    seen = np.sum(hum, axis=0) + np.random.default_rng(1).normal(0, 0.01, time.size)
    view = NoiseView(Theme("light"))
    view.resize(308, 340)
    view.show()
    view.show_noise("V_C1", noise(seen, 1e-4))
    for _ in range(4):
        app.processEvents()
    assert "500\u00a0Hz" in view.said.text()
    assert squeezed(view) == []
    assert squeezed(view.said.parentWidget()) == []
    view.close()
