"""Runs on disk in the lanes: opened, looked at closely, exported."""

import threading
from copy import copy
from pathlib import Path

import numpy as np
from full_disk import full_after
from PySide6.QtCore import QMimeData, QPointF, Qt, QUrl
from PySide6.QtGui import QDropEvent
from PySide6.QtSvg import QSvgRenderer

from gui.dialogs.saving import table, write_scene, write_view
from gui.lanes import stored
from gui.lanes.source import PlanSource
from gui.session.steps import of_run
from tactile_lab.report.from_run import read
from tactile_lab.trace import Trace


def test_old_run_opens_in_the_same_lanes(lab) -> None:
    window, session = lab.window, lab.session
    folder = lab.complete_run()
    live_spikes = session.source.spikes.copy()
    lab.until(lambda: window.screen_.run is not None)  # its record, by itself
    record = window.screen_.run
    window.screen_.open_run(folder)
    lab.until(lambda: window.screen_.run not in (None, record))
    run = window.screen_.run
    assert np.allclose(run.spikes, live_spikes, atol=1e-3)
    told = [trial.response.latency for trial in read(folder).results]
    assert any(told)
    assert [step.response.latency for step in of_run(run)] == told, "as in the report"
    lab.until(lambda: run.model is not None)
    window.centre.view.show_span(0.2, 0.001)
    lab.until(lambda: run.twin("V_C2", 0.2, 0.201, 1000).time.size > 500)
    run.trace("V_C2", 0.2, 0.201, 1000)
    lab.until(lambda: run.trace("V_C2", 0.2, 0.201, 1000).time.size > 150)
    moved = run.trace("V_C2", 0.2004, 0.2014, 1000)
    closer = run.trace("V_C2", 0.2003, 0.2007, 1000)
    assert moved.time.size > 150 and closer.time.size > 60, "read around what is seen"


def test_the_run_that_was_asked_for_last_is_shown(lab, monkeypatch) -> None:
    """One that took longer to read came over it."""
    slow, quick = lab.runs(2)
    read, ready = stored.RunSource.__init__, threading.Event()

    def slowly(source: stored.RunSource, path: Path) -> None:
        if path == slow:
            ready.wait(60)
        read(source, path)

    monkeypatch.setattr(stored.RunSource, "__init__", slowly)
    lab.window.screen_.open_run(slow)
    lab.window.screen_.open_run(quick)
    lab.until(lambda: lab.session.opened == (quick.name,))
    ready.set()
    lab.until(lambda: not any(t.name == "open run" for t in threading.enumerate()))
    lab.app.processEvents()
    assert lab.session.opened == (quick.name,)


def test_a_run_that_has_ended_is_looked_at_from_its_record(lab) -> None:
    window, screen = lab.window, lab.window.screen_
    folder = lab.complete_run()
    lab.until(lambda: screen.run is not None)
    assert screen.run.path == folder
    assert window.session.name == folder.name
    assert window.centre.stack.source is screen.run
    assert screen.run.model is not None, "the model does not blink"
    live = window.session.source
    window.centre.view.show_span(0.2, 0.001)
    rows = table(window.centre.stack, "view").splitlines()
    assert len(rows) > 150, "the samples of this view were read for it"
    lab.until(lambda: screen.run.trace("V_C2", 0.2, 0.201, 1000).time.size > 150)
    assert live.trace("V_C2", 0.2, 0.201, 1000).time.size < 10, "seen live: bins"


def test_card_of_a_stored_run_has_what_is_at_the_right_edge(lab) -> None:
    window = lab.window
    folder = lab.runs(1)[0]
    window.screen_.open_run(folder)
    lab.until(lambda: window.session.opened == (folder.name,))
    said = window.centre.notice
    window.review.export.click()  # this screen has no desktop behind it
    assert said.text() == f"No program of this computer opens it; it is at {folder}."
    run, stack, view = window.screen_.run, window.centre.stack, window.centre.view
    past = [one for one in run.signals if run.ends(one) > run.reach]
    assert not past, "where a comparison would read nothing"
    begin, _ = run.holds[-1].held
    run.spikes = np.array([begin - 0.5, begin + 0.05, begin + 0.15, begin + 0.29])
    view.show_span(begin, 0.25)

    def says(key: str) -> str:
        return stack.row(key).card.text

    lab.until(lambda: says("spikes") == "2" and says("force") == "120.0")
    lab.until(lambda: says("rate") == "10.00")
    assert stack.row("spikes").card.more in ("", "of 4 · last ISI 100.0 ms")
    shown = run.trace("V_C1", begin, begin + 0.25, 500)
    assert abs(float(says("V_C1")) - shown.at(begin + 0.25)) < 0.02
    view.show_span(0.0, run.holds[0].start)
    lab.until(lambda: says("spikes") == "0" and says("rate") == "0.00")
    view.show_all()
    lab.until(lambda: says("spikes") == "4" and says("force") == "0.0")
    known = says("V_C1")
    lab.until(lambda: stack.row("residual"))  # the model comes when it is computed
    run.reach = run.length = run.reach + 0.3  # its coil was late to go to 0 A
    late = np.array([0.0, run.reach - 0.1])
    run._lines["force"] = Trace.steps(late, np.array([0.12, 0.0]), run.reach)
    stack.show_source(run)
    view.set_now(run.reach, run.length)
    view.show_all()
    lab.until(lambda: stack.row("V_C2").box.painted.end == run.reach)
    stack.show_values()
    for key in ("V_C2", "V_K", "residual"):
        assert says(key) != "—", "all that was measured has a last value"
    assert says("V_C1") == known
    assert says("force") == "0.0", "where its own lane ends"


def test_dropped_scene_is_loaded_and_dropped_run_is_opened(lab) -> None:
    window = lab.window
    file = lab.folder / "dropped.toml"
    file.write_text('[protocol]\nname = "pulses"\nlevels = ["70 mN"]\n')
    data = QMimeData()
    data.setUrls([QUrl.fromLocalFile(str(file))])
    event = QDropEvent(
        QPointF(50, 200), Qt.DropAction.CopyAction, data,
        Qt.MouseButton.LeftButton, Qt.KeyboardModifier.NoModifier,
    )  # fmt: skip
    window.dropEvent(event)
    assert window.setup.form.field("levels").text == "70 mN"
    bad = lab.folder / "bad.toml"
    bad.write_text('[protocol]\nname = "pulses"\nlevel = ["70 mN"]\n')
    window.screen_.open_path(bad)
    assert window.centre.notice.isVisible()
    assert "levels" in window.centre.notice.text()
    assert window.setup.form.field("levels").text == "70 mN"
    window.screen_.open_path(file)
    assert not window.centre.notice.isVisible(), "it was of another scene"


def test_view_is_exported(lab) -> None:
    window, folder = lab.window, lab.folder
    for name in ("view.png", "view.svg", "VIEW.CSV", "view.csv"):
        write_view(window.panels, folder / name)
        assert (folder / name).stat().st_size > 100
    assert QSvgRenderer(str(folder / "view.svg")).isValid()
    before = {file: file.read_bytes() for file in folder.glob("view.*")}
    write_scene(window.panels, folder / "saved.toml")
    notice = window.centre.notice
    write_view(window.panels, folder / "view.what")
    assert f"{folder / 'view.what'} was not saved" in notice.text()
    assert "End it in .png" in notice.text()
    for file in before:
        inside = file / "in a file.png"
        write_view(window.panels, inside)
        assert f"{inside} was not saved" in window.session.log.lines[-1].text
        assert notice.text() == window.session.log.lines[-1].text
        write_scene(window.panels, folder / "saved.toml")
        assert not notice.isVisible()
        with full_after(50):
            write_view(window.panels, file)
            assert "File too large" in notice.text(), "of a picture: End it in .png"
            write_scene(window.panels, folder / "saved.toml")
        assert "not saved" in window.session.log.lines[-1].text
        assert file.read_bytes() == before[file]
    (folder / "run.json").write_text("{}")  # as beside a run
    write_scene(window.panels, folder / "scene.toml")
    assert "is made of" in notice.text() and not (folder / "scene.toml").exists()
    header = (folder / "view.csv").read_text().splitlines()[1]
    assert "V_C1_time_s" in header and "force_mean_N" in header
    assert 'name = "pulses"' in (folder / "saved.toml").read_text()


def test_an_export_is_stamped_by_the_bench_that_recorded_it(lab, monkeypatch) -> None:
    """It was by the one that is connected now."""
    window, session, file = lab.window, lab.session, lab.folder / "stamped.csv"

    def stamp() -> str:
        write_view(window.panels, file)
        return file.read_text().splitlines()[0]

    session.show_monitor(True)
    lab.until(lambda: session.monitor.source is not None)
    session.show_monitor(False)
    lab.until(lambda: not session.monitor.alive)
    measured = copy(session.bench.spec)
    object.__setattr__(measured, "simulated", False)
    monkeypatch.setattr(session.bench, "spec", measured)
    assert "Monitor · SIMULATED" in stamp()
    lab.run()
    assert "SIMULATED" in stamp()
    window.centre.tools.freeze.setChecked(True)
    assert "SIMULATED" in stamp()
    window.centre.tools.freeze.setChecked(False)
    session.source.simulated = False
    assert "measured" in stamp()
    window.centre.stack.show_source(PlanSource(session.plan.expectation.preview))
    assert "SIMULATED" in stamp(), "the model computed it"


def test_a_long_path_above_the_lanes_is_shortened_in_its_middle(lab) -> None:
    """Its end, which names the file, was cut off."""
    window, notice = lab.window, lab.window.centre.notice
    path = f"/{'a folder/' + 'long' * 80}/view.png"
    before = window.centre.lanes.minimumSizeHint().width()
    window.centre.say(f"{path} was not saved: the disk is full.")
    lab.app.processEvents()
    assert window.centre.lanes.minimumSizeHint().width() == before
    shown = notice.text()
    widest = max(map(notice.fontMetrics().horizontalAdvance, shown.split()))
    assert widest <= notice.contentsRect().width()
    assert "…" in shown and "/view.png was not saved: the disk is full." in shown
    assert path in notice.toolTip()
    window.centre.say("The disk is full.")
    assert (notice.text(), notice.toolTip()) == ("The disk is full.", "")
    window.centre.say("")
    assert not notice.isVisible()
