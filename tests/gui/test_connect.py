"""The connect dialog: discovery through the real look-up, a bench file that loads."""

import json
import os
import tomllib
from pathlib import Path

import numpy as np
import pytest
from PySide6.QtCore import Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QLabel, QPushButton
from serial import serial_for_url

from gui.dialogs.bench_text import (
    BY_PERSON,
    bench_text,
    show_bench,
    start_choice,
)
from gui.dialogs.connect import Connect
from gui.dialogs.instruments import InstrumentsPage
from gui.review.conclusion import ShownConclusion, conclusion_of
from gui.state import CoilKnowledge, FaultNotice, WindowState
from sim_backend.serve import ServedBench
from tactile_lab.engine.request import Request
from tactile_lab.errors import RunFolderError, SceneError
from tactile_lab.scene.load import load_bench
from tactile_lab.scene.write_bench import write_bench


def test_bench_file_reads_back_as_chosen(tmp_path: Path) -> None:
    choice = start_choice()
    choice.name, choice.coil_port = "lab 3", "/dev/ttyUSB0"
    choice.meter_port = "/dev/ttyUSB1"
    spec = write_bench(bench_text(choice), tmp_path / "bench.toml")
    assert not spec.simulated and spec.name == "lab 3"
    assert spec.coil is not None and spec.coil.port == "/dev/ttyUSB0"
    assert spec.field_meter is not None and spec.field_meter.port == "/dev/ttyUSB1"
    assert [c.signal for c in spec.scope.channels] == [
        "V_C1",
        "V_C2",
        "V_K",
        "coil_current",
    ]
    assert spec.scope.channels[3].scale == 10.0


def test_true_minus_on_screen_and_keyboards_minus_in_the_file() -> None:
    choice = start_choice()
    choice.coil_port = "/dev/ttyUSB0"
    assert choice.channels[0][3] == "−2.5 V"
    assert choice.magnet["A1"] == "28.27 mm²"
    text = bench_text(choice)
    assert 'offset = "-2.5 V"' in text and text.isascii()
    choice.channels[0] = (*choice.channels[0][:3], "-2.5 V", "")
    assert bench_text(choice) == text


def test_unused_instruments_are_left_out() -> None:
    choice = start_choice()
    choice.scope = ""
    data = tomllib.loads(bench_text(choice))
    assert not {"coil", "field_meter", "scope"} & set(data)


def test_wrong_range_is_refused_and_leaves_no_file(tmp_path: Path) -> None:
    choice = start_choice()
    choice.coil_port = "/dev/ttyUSB0"
    where, signal, _, offset, shunt = choice.channels[0]
    choice.channels[0] = (where, signal, "2 mN", offset, shunt)
    with pytest.raises(SceneError, match="mN"):
        write_bench(bench_text(choice), tmp_path / "bench.toml")
    assert list(tmp_path.iterdir()) == []


def test_look_does_not_block_and_tells_what_it_found(lab) -> None:
    window = lab.window
    window.actions_.connect_dialog()
    dialog = window.findChild(Connect)
    assert isinstance(dialog, Connect) and dialog.isVisible()
    dialog.instruments.scan.click()
    assert not dialog.instruments.scan.isEnabled()
    lab.until(lambda: dialog.instruments.scan.isEnabled())
    assert dialog.instruments.attached.told.text() != "Looking …"
    dialog.calibration.force.click()
    assert not dialog.isVisible()
    assert window.setup.kind_name == "force_check"


def test_what_is_found_is_suggested_where_it_fits(lab) -> None:
    page = InstrumentsPage(start_choice(), lab.window.theme)
    nothing = {"kind": "serial", "title": "port", "identity": None, "fits": ()}
    found = [
        {**nothing, "address": "COM1", "problem": "nothing answered"},
        {**nothing, "address": "COM3", "identity": "LSCI,MODEL455", "problem": None,
         "fits": ("lakeshore-455",)},
        {**nothing, "address": "COM4", "identity": "KEITHLEY 2420", "problem": None,
         "fits": ("keithley-2420",)},
    ]  # fmt: skip
    page.found.emit(found)
    chosen = page.take()
    assert (chosen.coil_port, chosen.coil_dialect) == ("COM4", "keithley-2420")
    assert (chosen.meter_port, chosen.meter_dialect) == ("COM3", "lakeshore-455")
    labels = page.attached.findChildren(QLabel)
    assert "nothing answered" in [label.text() for label in labels]
    page.deleteLater()


@pytest.mark.skipif(os.name != "posix", reason="needs a pseudo-terminal")
def test_instrument_is_tried_out_and_says_so_below_its_row(lab) -> None:
    served = ServedBench(coil="pty")
    served.start()
    page = InstrumentsPage(start_choice(), lab.window.theme)
    page.test_coil.click()
    assert "port" in page.answers["coil"].text(), "nothing to ask"
    page.coil_port.setCurrentText(served.addresses["coil"])
    page.test_coil.click()
    lab.until(lambda: page.answers["coil"].text().startswith("✓"))
    assert "KEPCO" in page.answers["coil"].text()
    assert "output off" in page.answers["coil"].text()
    page.meter_port.setCurrentText("/dev/not-there")
    page.test_meter.click()
    lab.until(lambda: page.answers["meter"].property("role") == "error")
    assert "not-there" in page.answers["meter"].text()
    assert "`" not in page.answers["meter"].text()
    served.close()
    page.deleteLater()


def concluded(folder: Path, protocol: str, **more: object) -> Path:
    """A run's folder with a report that concludes so."""
    folder.mkdir(exist_ok=True)
    text = json.dumps({"protocol": protocol, "conclusion": {}, **more})
    (folder / "results.json").write_text(text)
    return folder


def test_wiring_check_runs_from_its_page_and_shows_its_verdicts(
    lab, monkeypatch: pytest.MonkeyPatch
) -> None:
    window, session = lab.window, lab.session
    asked: list[Request] = []
    monkeypatch.setattr(session, "start", lambda request, *_: asked.append(request))
    window.actions_.connect_dialog()
    dialog = window.findChild(Connect)
    dialog.show_page(1)
    session.status.enter(WindowState.FAULT)
    assert dialog.wiring.progress.text() == "Acknowledge the fault first."
    session.status.enter(WindowState.READY)
    dialog.wiring.check.click()
    assert window.setup.kind_name == "wiring_check", "the form shows what is run"
    assert not dialog.wiring.check.isEnabled()
    lab.until(lambda: asked)
    assert asked[0].path == "wiring_check" and asked[0].bench == "sim"
    session.run.trial, session.run.expected = (0, "rest"), 60.0
    session.status.enter(WindowState.RUNNING)
    assert dialog.wiring.progress.text() == "Step 1: rest", (
        "time left would stand still"
    )
    session.status.fault = FaultNotice("The coil source is gone.", "Coil off.")
    session.status.enter(WindowState.FAULT)
    assert dialog.wiring.progress.text() == "The coil source is gone."
    session.status.changed.emit()
    assert dialog.wiring.progress.text() == "Acknowledge the fault first."
    session.acknowledge()
    lab.until(dialog.wiring.check.isEnabled)
    said = {"V_C1": {"ok": True, "text": "4.35 V at rest"},
            "V_C2": {"ok": False, "text": "0 V at rest: open probe"}}  # fmt: skip
    made = concluded(
        lab.folder / "checked", "wiring_check", conclusion={"channels": said},
        statements=["V_C1: as wired, 4.35 V at rest.", "V_C1: 3 mV of 50 Hz hum."],
    )  # fmt: skip
    session.run.reported.emit(made)
    assert dialog.wiring.verdicts == [
        "V_C1 as wired: 4.35 V at rest",
        "V_C2 WRONG: 0 V at rest: open probe",
    ]
    assert dialog.wiring.mark.text() == "1 of 2 channels WRONG"
    texts = [one.text() for one in dialog.wiring.findChildren(QLabel)]
    assert any("3 mV of 50 Hz hum" in text for text in texts)
    dialog.hide()


def test_both_parts_of_the_loop_can_be_read_beside_what_was_found(lab) -> None:
    lab.window.actions_.connect_dialog()
    dialog = lab.window.findChild(Connect)
    dialog.show_page(2)
    page, current = dialog.calibration, np.linspace(-1, 1, 21)
    page.show_loop(np.c_[current, 0.011 * current])
    page.show_conclusion(ShownConclusion("", ("found",) * 4, (), (), (), Path("c.csv")))
    try:
        lab.until(lambda: page.loop.isVisible() and len(page.loop.panels) == 2)
        lab.app.processEvents()
        assert all(panel.box.height() >= 80 for panel in page.loop.panels)
    finally:
        page.show_progress("", busy=True)  # without findings, as it was
        page.show_progress("", busy=False)
        page.loop.hide()
        dialog.show_page(0)
        dialog.hide()


def test_calibration_is_offered_and_used_by_the_bench(lab) -> None:
    window, session = lab.window, lab.session
    window.actions_.connect_dialog()
    dialog = window.findChild(Connect)
    session.run.reported.emit(
        concluded(lab.folder / "none", "calibrate_field", statements=["No."])
    )
    assert dialog.calibration.use.isHidden(), "without a file there is nothing to use"
    made = concluded(lab.folder / "field", "calibrate_field", statements=["Good."])
    (made / "calibration.csv").write_text(
        "current_A,field_T\n-1,-0.009\n0,0\n1,0.009\n"
    )
    session.run.reported.emit(made)
    assert not dialog.calibration.use.isHidden()
    dialog.name.setText("Bench by the door")
    assert dialog.use_calibration(made / "calibration.csv", lab.folder / "own.toml")
    lab.until(lambda: session.state is WindowState.READY)
    assert session.bench.spec.name == "Bench by the door", "as its field says"
    magnet = session.bench.spec.magnet
    assert magnet.calibration is not None and abs(magnet.calibration.most - 1) < 1e-9
    assert "own-field.csv" in dialog.calibration.named.text()
    dialog.hide()
    session.disconnect_bench()


def test_damaged_results_are_refused_with_what_to_do(tmp_path: Path) -> None:
    with pytest.raises(RunFolderError, match="tactile-lab report"):
        conclusion_of(tmp_path)
    (tmp_path / "results.json").write_text("[]")
    with pytest.raises(RunFolderError, match=r"results\.json"):
        conclusion_of(tmp_path)


def test_dialog_keeps_what_it_does_not_show(tmp_path: Path) -> None:
    text = bench_text(start_choice()) + "[hand_set]\nV_GS = '1.3 V'\n"
    text = text.replace('input = "C"', 'input = "C", coupling = "AC", scale = 10.0')
    (tmp_path / "before.toml").write_text(text)
    choice = start_choice()
    show_bench(choice, load_bench(tmp_path / "before.toml"))
    spec = write_bench(bench_text(choice), tmp_path / "after.toml")
    assert spec.hand_set == {"V_GS": 1.3}
    (channel,) = [c for c in spec.scope.channels if c.signal == "V_K"]
    assert (channel.coupling, channel.scale) == ("AC", 10.0)


def test_a_teslameter_that_a_person_reads_needs_no_port(lab, tmp_path: Path) -> None:
    choice = start_choice()
    page = InstrumentsPage(choice, lab.window.theme)
    assert page.meter_port.isEnabled()
    page.meter_row.setCurrentText(BY_PERSON)
    assert not page.meter_port.isEnabled() and not page.test_meter.isEnabled()
    spec = write_bench(bench_text(page.take()), tmp_path / "bench.toml")
    assert spec.field_meter is not None and spec.field_meter.driver == "manual"
    again = start_choice()
    show_bench(again, spec)
    assert InstrumentsPage(again, lab.window.theme).meter_row.currentText() == BY_PERSON
    page.deleteLater()


def test_the_dialog_offers_registered_scopes_and_keeps_ones_own(lab) -> None:
    choice = start_choice()
    choice.scope = "/lab/my_scope.py"
    page = InstrumentsPage(choice, lab.window.theme)
    offered = [page.scope.itemData(k) for k in range(page.scope.count())]
    assert offered == ["ps3000a", "usbtmc", "", "/lab/my_scope.py"]
    assert page.take().scope == "/lab/my_scope.py"
    page.deleteLater()


def test_absent_source_is_a_fault_and_then_no_bench(lab) -> None:
    window, session = lab.window, lab.session
    window.actions_.connect_dialog()
    dialog = window.findChild(Connect)
    assert isinstance(dialog, Connect)
    dialog.instruments.coil_port.setCurrentText("/dev/not-there")
    assert dialog.save_to(lab.folder / "absent.toml")
    lab.until(lambda: session.state is WindowState.FAULT)
    assert "not-there" in session.status.fault.consequence
    window.banner.acknowledge.click()
    assert session.state is WindowState.DISCONNECTED
    assert window.centre.empty.isVisible()


def test_a_bench_that_did_not_answer_can_be_connected_again(lab) -> None:
    """It was nowhere to be found: the simulated one was offered in its place."""
    window, session = lab.window, lab.session
    window.actions_.connect_dialog()
    dialog = window.findChild(Connect)
    dialog.instruments.coil_port.setCurrentText("/dev/not-there")
    file = lab.folder / "absent.toml"
    assert dialog.save_to(file)
    lab.until(lambda: session.state is WindowState.FAULT)
    window.banner.acknowledge.click()
    card = window.centre.empty
    offered = [b for b in card.findChildren(QPushButton) if b.isVisible()]
    (first,) = (b for b in offered if b.property("role") == "primary")
    assert first.text() == "Connect again"
    first.click()
    assert session.state is WindowState.CONNECTING
    lab.until(lambda: session.state is WindowState.FAULT)
    assert "not-there" in session.status.fault.consequence, "it is asked anew"
    window.banner.acknowledge.click()
    session.bench.let_go()
    window.render_state()
    assert card.simulated.isVisible() and not card.again.isVisible()


def test_a_bench_whose_file_was_mended_can_be_connected_again(lab, source) -> None:
    """One that did not load was forgotten: only the simulated one was offered."""
    window, session = lab.window, lab.session
    session.disconnect_bench()
    whole = source.bench.read_text()
    file = source.bench.with_name("mistyped.toml")
    file.write_text(whole.replace("port", "prot"))
    session.connect_bench(str(file))
    assert session.state is WindowState.FAULT and not session.bench.choice
    window.banner.acknowledge.click()
    card = window.centre.empty
    assert card.again.isVisible() and "mistyped.toml" in card.text.text()
    file.write_text(whole)
    card.again.click()
    lab.until(lambda: session.state is WindowState.READY)
    assert session.bench.choice == str(file) and not session.bench.refused
    session.disconnect_bench()
    assert card.simulated.isVisible() and not card.again.isVisible()


def test_a_source_that_answered_is_not_told_as_silent(lab, source) -> None:
    """Of one whose output was on: "See to what did not answer"."""
    window, session = lab.window, lab.session
    session.connect_bench(str(source.bench))
    lab.until(lambda: session.state is WindowState.READY)
    with serial_for_url(source.served.addresses["coil"]) as by_hand:
        by_hand.write(b"CURR 0.3\nOUTP 1\n")
        lab.until(lambda: source.output)
    session.bench.look()
    lab.until(lambda: session.state is WindowState.FAULT)
    window.banner.acknowledge.click()
    said = window.centre.empty.text.text()
    assert "whose output was found on" in said and "did not answer" not in said
    source.served.close()
    session.connect_again()
    lab.until(lambda: session.state is WindowState.FAULT)
    window.banner.acknowledge.click()
    assert "See to what did not answer" in window.centre.empty.text.text()
    session.bench.let_go()


def test_asking_again_makes_no_unknown_coil_known(lab) -> None:
    """STOP said "no coil source" until there was an answer."""
    window, session = lab.window, lab.session
    window.actions_.connect_dialog()
    dialog = window.findChild(Connect)
    dialog.instruments.coil_port.setCurrentText("/dev/not-there")
    assert dialog.save_to(lab.folder / "absent.toml")
    lab.until(lambda: session.state is WindowState.FAULT)
    session.acknowledge()
    for bench in (str(lab.folder / "absent.toml"), "sim"):
        assert window.header.stop.truth is CoilKnowledge.UNKNOWN
        session.connect_bench(bench)
        assert session.state is WindowState.CONNECTING
        assert window.header.stop.truth is CoilKnowledge.UNKNOWN, "nobody has answered"
        lab.until(lambda: session.state is not WindowState.CONNECTING)
        session.acknowledge()
    lab.until(lambda: session.state is WindowState.READY)
    assert window.header.stop.truth is CoilKnowledge.UNKNOWN, "of the bench before"
    window.banner.is_off.click()
    assert window.header.stop.truth is CoilKnowledge.OFF, "read back"


def test_a_bench_that_cannot_be_connected_now_is_saved_and_says_so(lab) -> None:
    window, session = lab.window, lab.session
    lab.run()
    window.actions_.connect_dialog()
    dialog = window.findChild(Connect)
    file = lab.folder / "later.toml"
    dialog.save_to(file)
    assert file.exists() and session.bench.choice != str(file)
    assert dialog.isVisible() and "is in use" in dialog.problem.text()
    dialog.hide()


def test_a_card_that_closes_gives_the_keyboard_back_to_the_window(lab) -> None:
    window = lab.window
    window.activateWindow()
    lab.until(window.isActiveWindow)
    window.page.setFocus()  # another test may have left it in a lane
    window.actions_.connect_dialog()
    dialog = window.findChild(Connect)
    assert lab.app.focusWidget() is dialog.instruments.scan
    QTest.mouseClick(dialog.close_button, Qt.MouseButton.LeftButton)
    assert dialog.isHidden() and lab.app.focusWidget() is window.page
