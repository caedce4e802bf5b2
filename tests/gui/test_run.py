"""A run from start to end, as the window shows and stops it."""

import json
import threading
from dataclasses import replace
from shutil import rmtree
from types import SimpleNamespace

import pytest
from PySide6.QtCore import Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import (
    QAbstractButton,
)

from gui.dialogs.help import Help
from gui.lanes.expected import Preview, Stretch
from gui.lanes.live import LiveSource
from gui.lanes.source import PlanSource
from gui.session.steps import facts_of
from gui.state import CoilKnowledge, CoilView, Lamp, Snapshot, WindowState, truth
from sim_backend.serial_line import wires as serial_wires
from sim_backend.serial_line.faults import SerialFault
from tactile_lab.acquisition.ending import Ending
from tactile_lab.acquisition.events import RunState
from tactile_lab.bench import OffReport
from tactile_lab.engine import memory
from tactile_lab.engine.request import Request
from tactile_lab.store.recorder import Recorder
from tactile_lab.waveform import Waveform

FORCE = """
[protocol]
name = "pulses"
levels = ["80 mN"]
hold = "300 ms"
rest = "100 ms"

[record]
signals = ["force"]
"""


def newest_coil() -> serial_wires.FarEnd:
    """Far end of the coil wire plugged in last."""
    return [far for name, far in serial_wires._far_ends.items() if "coil" in name][-1]


def red_share(button: QAbstractButton) -> float:
    image = button.grab().toImage()
    red = 0
    for x in range(0, image.width(), 4):
        for y in range(0, image.height(), 4):
            colour = image.pixelColor(x, y)
            red += colour.red() > 150 and colour.green() < 90 and colour.blue() < 110
    return red / ((image.width() // 4) * (image.height() // 4))


def test_ready_offers_run_and_shows_the_plan(lab) -> None:
    window = lab.window
    window.screen_.leave_run()
    lab.session.source = None  # a run that another test left on screen
    window.setup.plan_now()
    lab.until(lambda: isinstance(window.centre.stack.source, PlanSource))
    assert window.setup.run.isEnabled()
    assert window.header.stop.truth is CoilKnowledge.OFF
    assert window.header.badge.isVisible()
    keys = [row.lane.key for row in window.centre.stack.visible_rows()]
    assert keys == ["force", "V_C1", "residual", "V_C2", "V_K", "spikes", "rate"]
    assert window.centre.stack.source.twin_spikes.size > 0


def test_a_run_in_progress_shows_the_coil_live(lab) -> None:
    window = lab.window
    lab.run()
    assert not window.setup.run.isEnabled()
    lab.until(lambda: window.header.stop.truth is CoilKnowledge.LIVE)
    assert red_share(window.header.stop) > 0.5


def test_run_moves_lanes_and_gives_results(lab) -> None:
    window, session = lab.window, lab.session
    lab.complete_run()
    source = session.source
    assert source is not None and source.reach > 1.0
    assert not source.trace("V_C1", 0.0, 2.0, 500).empty
    assert [f.label for f in window.screen_.results.steps] == ["80 mN", "120 mN"]
    assert window.review.results.mark.text().startswith("final")
    lab.until(lambda: window.header.stop.truth is CoilKnowledge.OFF)


def test_a_run_of_the_force_alone_claims_nothing_of_the_sensor(lab) -> None:
    """Model was lit, 0 samples were lost, and the results were blank."""
    window, session = lab.window, lab.session
    scene = lab.folder / "force.toml"
    scene.write_text(FORCE)
    assert window.screen_.open_scene(str(scene))
    session.plan.expectation = None
    lab.until(lambda: session.plan.expectation is not None)
    window.setup.run.click()
    lab.until(lambda: session.state is WindowState.READY and not session.busy)
    folder = session.run.folder
    lab.until(lambda: getattr(window.screen_.run, "path", None) == folder)
    lab.until(lambda: session.desk.idle)
    window.frames.tick()
    window.render_state()
    assert not window.centre.tools.twin.isEnabled()
    stored = [line.text for line in session.log.lines if line.source == "store"]
    assert stored[-1].endswith("complete: spikes not looked for")
    results = window.review.results
    for said in results._facts_text.text(), facts_of(window.screen_.run):
        assert "samples" not in said and "S/s" not in said, "none were asked for"
    lost = json.loads((folder / "run.json").read_text())["loss"]["text"]
    assert lost.startswith("loss: no samples were asked for, ")
    assert results.plot.isVisibleTo(results)
    assert results.plot.nothing.startswith("Spikes are not looked for")


def test_a_run_that_broke_is_not_no_run(lab) -> None:
    """What broke is a fault of ours; the engine tells it as it tells any ending."""
    off = OffReport(True, 0.0, "Output off, 0 A read back.")
    lab.session.run.has_ended(Ending(RunState.FAULTED, off, "It broke. KeyError: 'a'"))
    assert lab.window.screen_.ending == f"Broke · {lab.session.run.name}"
    lab.session.acknowledge()
    lab.until(lambda: lab.session.state is WindowState.READY)


def test_stop_says_what_is_known_of_the_coil_in_the_same_frame(
    lab, monkeypatch: pytest.MonkeyPatch
) -> None:
    window, session = lab.window, lab.session
    lab.run()
    monkeypatch.setattr(window.frames, "_numbers", float("inf"))  # they come later
    session.stop()
    said = []

    def over() -> bool:
        state, coil = session.state, session.coil_view()
        said.append((window.header.stop.truth, truth(state, coil)))
        return not session.busy

    lab.until(over)
    assert [told for told, known in said if told is not known] == []


@pytest.mark.parametrize("how", ["click", "Esc", "F12"])
def test_stop_ends_the_run_with_the_coil_off(lab, how: str) -> None:
    window, session = lab.window, lab.session
    lab.run()
    assert window.header.stop.isEnabled()
    if how == "click":
        QTest.mouseClick(window.header.stop, Qt.MouseButton.LeftButton)
    else:
        key = {"Esc": Qt.Key.Key_Escape, "F12": Qt.Key.Key_F12}[how]
        QTest.keyClick(window, key)  # to it, whichever window is the active one
    said = [line.text for line in session.log.lines[-6:]]
    assert session.state is WindowState.ABORTING, said
    lab.until(lambda: session.state is WindowState.READY)
    coil = session.coil_view()
    assert coil is not None and coil.output is False and coil.verified_off
    assert window.screen_.ending.startswith("Aborted")


def test_what_a_run_has_freed_is_given_back_beside_the_window_thread(
    lab, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It takes some 40 ms of it, in which the next run may have begun."""
    where: list[threading.Thread] = []
    monkeypatch.setattr(
        memory, "forget_code", lambda: where.append(threading.current_thread())
    )
    lab.run()
    lab.session.stop()
    lab.until(lambda: not lab.session.busy)
    where.clear()  # of the engine, which is a thread here
    lab.until(lambda: where)
    assert threading.main_thread() not in where


def test_stop_is_enabled_in_every_state(lab) -> None:
    for state in WindowState:
        lab.session.status.state = state
        lab.window.render_state()
        assert lab.window.header.stop.isEnabled()
        assert lab.window.header.stop.isVisible()
    lab.session.status.state = WindowState.READY
    lab.window.render_state()


def test_nobody_is_said_to_be_well_while_a_run_is_stopped(lab, monkeypatch) -> None:
    """An instrument that is gone may be why: its lamp was green until the run's end."""
    session = lab.session
    monkeypatch.setattr(session.run, "expectation", session.plan.expectation)
    session.status.enter(WindowState.ABORTING)
    lamps = {one.name: one.lamp for one in session.snapshot().instruments}
    session.status.enter(WindowState.READY)
    del lamps["Model"]
    assert "Oscilloscope" in lamps and set(lamps.values()) == {Lamp.WAITING}


def test_a_folder_that_cannot_be_written_is_told_as_the_window_sets_it(lab) -> None:
    """It named --out, which is of the command line."""
    window, session, out = lab.window, lab.session, lab.session.out
    session.keep_in(lab.folder / "short.toml" / "runs")  # within a file
    window.setup.run.click()
    lab.until(lambda: session.state is WindowState.FAULT)
    session.keep_in(out)
    told = session.status.fault.consequence
    assert "Choose a writable folder in Settings" in told and "--out" not in told
    lines = [line.text for line in session.log.lines[-4:]]
    assert any("in Settings" in line for line in lines)
    assert not any("--out" in line for line in lines)


def test_pauses_are_none_of_the_steps_that_results_wait_for(lab, monkeypatch) -> None:
    window, run = lab.window, lab.session.run
    source = LiveSource(None, 1.0)
    force = Waveform.through([(0.0, 0.0), (4.0, 0.0)])
    holds = [Stretch(k, k + 1, "", pause=k == 1) for k in range(4)]
    expected = replace(
        lab.session.plan.expectation, preview=Preview(force, holds=holds)
    )
    monkeypatch.setattr(run, "source", source)
    monkeypatch.setattr(run, "expectation", expected)
    window.screen_.follow_run(source)
    assert window.review.results.mark.text() == "preliminary · 0 of 3 steps"


def test_unplugged_coil_becomes_a_fault_that_says_what_to_do(lab, monkeypatch) -> None:
    """The bell rings three times at it, where that is wanted, not a fourth time."""
    window, session = lab.window, lab.session
    rings: list[str] = []
    bell = SimpleNamespace(beep=lambda: rings.append(session.state.value))
    monkeypatch.setattr("gui.habits.QApplication", bell)
    monkeypatch.setattr("gui.habits.APART", 1)
    monkeypatch.setattr("gui.habits.stop_truth", lambda *_: None)  # rings of its own
    monkeypatch.setattr(window.preferences, "wants", lambda switch: switch == "sound")
    lab.run()
    newest_coil().faults.add(SerialFault(kind="unplug", times=None))
    lab.until(lambda: session.state is WindowState.FAULT)
    lab.until(lambda: len(rings) >= 3 and not window._habits._bell.isActive())
    assert rings == 3 * [WindowState.FAULT.value]
    assert window.banner.isVisible()
    assert window.header.stop.truth is CoilKnowledge.UNKNOWN
    assert window.header.stop.words.title == "COIL STATE UNKNOWN"
    assert not window.setup.run.isEnabled()
    window.banner.acknowledge.click()
    assert session.state is not WindowState.FAULT
    assert window.header.stop.truth is CoilKnowledge.UNKNOWN, (
        "reading a fault verifies nothing"
    )
    assert not window.setup.run.isEnabled(), "and nothing runs beside it"
    lab.until(lambda: session.state is WindowState.READY)
    assert window.header.stop.truth is CoilKnowledge.OFF, "the instruments were asked"


def test_the_bell_rings_as_soon_as_nobody_knows_the_coil(lab, monkeypatch) -> None:
    """A source fell silent in a run; it rang 17 s later, as the run had ended."""
    window = lab.window
    rings: list[int] = []
    monkeypatch.setattr(window._habits, "_sound", rings.append)
    live = Snapshot(state=WindowState.RUNNING, coil=CoilView(output=True))
    silent = replace(live, coil=CoilView(output=True, age=2.0))
    for told, times in ((live, 0), (silent, 1), (silent, 1), (live, 1), (silent, 2)):
        window.frames.told.emit(told)
        assert rings == times * [3]
    window.render_state()


def test_reconnecting_makes_the_coil_known_again(lab) -> None:
    session = lab.session
    session.connect_bench("sim")
    assert session.state is WindowState.CONNECTING
    lab.until(lambda: session.state is WindowState.READY)
    assert lab.window.header.stop.truth is CoilKnowledge.OFF


def test_a_run_stopped_before_its_first_sample_is_no_new_problem(lab) -> None:
    window, session = lab.window, lab.session
    window.setup.start()
    session.stop("at once")
    lab.until(lambda: not session.busy and session.state is not WindowState.ABORTING)
    lab.until(lambda: not any(t.name == "open run" for t in threading.enumerate()))
    lab.app.processEvents()
    assert not window.centre.notice.isVisible(), window.centre.notice.text()
    session.acknowledge()


def test_freeze_holds_the_lanes_while_acquisition_goes_on(lab) -> None:
    window, session = lab.window, lab.session
    lab.run()
    view = window.centre.view
    lab.until(lambda: view.now > 1.0)
    window.page.setFocus()
    QTest.keyClick(window, Qt.Key.Key_Space)
    seen, shown = view.now, window.centre.stack.source
    lab.until(lambda: session.source.reach > seen + 1.0)
    assert view.now == seen
    assert window.centre.stack.source is shown and shown.reach == seen
    window.centre.tools.freeze.click()
    assert window.centre.stack.source is session.source
    lab.until(lambda: view.now > seen + 1.0)


def test_another_run_is_not_frozen(lab) -> None:
    window = lab.window
    window.centre.tools.freeze.setChecked(True)
    lab.run()
    lab.until(lambda: window.centre.view.now > 0)
    assert not window.centre.tools.freeze.isChecked()


def test_esc_closes_a_card_between_runs_and_is_stop_in_one(lab) -> None:
    window, session = lab.window, lab.session
    window.actions_.show_help()
    card = window.findChild(Help)
    QTest.keyClick(card.close_button, Qt.Key.Key_Escape)
    assert not card.isVisible() and session.state is WindowState.READY
    lab.run()
    window.actions_.show_help()
    QTest.keyClick(card.close_button, Qt.Key.Key_Escape)
    assert session.state is WindowState.ABORTING
    card.hide()


def test_a_run_whose_folder_is_deleted_is_told_in_words_of_the_window(lab) -> None:
    """Of a folder that was gone it said what is kept, and to run recover with --out."""
    session = lab.session
    lab.run()
    lab.until(lambda: session.source.reach > 1.0)
    rmtree(session.run.folder)
    lab.until(lambda: session.state is WindowState.FAULT and not session.busy)
    fault = session.status.fault
    assert "is gone: it was moved or deleted" in fault.title
    assert "recover" not in fault.title and "kept" not in fault.title
    assert fault.consequence.startswith("Nothing of it is in ")
    lab.until(lambda: lab.window.centre.progress.text.startswith("Broke"))
    assert "kept" not in lab.window.centre.progress.text


def test_a_disk_that_is_full_is_told_in_words_of_the_window(lab, monkeypatch) -> None:
    session = lab.session

    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    lab.run()
    lab.until(lambda: session.source.reach > 1.0)
    monkeypatch.setattr(Recorder, "_write_samples", full)
    lab.until(lambda: session.state is WindowState.FAULT and not session.busy)
    told = session.status.fault.title
    assert "choose another folder in Settings, and recover this run in Runs" in told
    assert "tactile-lab" not in told and "--out" not in told


def test_a_refused_run_is_logged_once(lab) -> None:
    session = lab.session
    strong = Request(str(lab.folder / "short.toml"), ('protocol.levels=["5 N"]',))
    said = len(session.log.lines)
    session.start(strong, "Strong")
    lab.until(lambda: session.state is WindowState.FAULT)
    told = [one for one in session.log.lines[said:] if "was refused" in one.text]
    assert len(told) == 1 and told[0].safety
    session.acknowledge()


def test_a_bench_that_is_refused_is_logged_once(lab) -> None:
    session = lab.session
    session.bench.request = replace(session.bench.request, path="no such scene")
    said = len(session.log.lines)
    session.bench.check()
    lab.until(lambda: session.state is WindowState.FAULT)
    told = [one.text for one in session.log.lines[said:]]
    assert len([text for text in told if "The bench cannot be used." in text]) == 1
    session.acknowledge()
