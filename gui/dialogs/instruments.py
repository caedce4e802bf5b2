"""The connect dialog's first page: look for instruments, choose, test."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from PySide6.QtCore import Signal
from PySide6.QtWidgets import QGridLayout, QWidget

from drivers.attached import attached, try_out
from gui.dialogs.attached import AttachedList
from gui.dialogs.bench_text import BY_PERSON, BenchChoice
from gui.look.theme import Theme
from gui.parts import (
    STRETCH,
    Combo,
    column,
    label,
    line,
    line_edit,
    push,
    row,
    say,
    set_role,
)
from tactile_lab.engine.threads import start
from tactile_lab.errors import TactileLabError
from tactile_lab.instruments.dialects import dialect_ids
from tactile_lab.instruments.registry import ScopeDriver, driver_names
from tactile_lab.quantity import show

SCOPES = {"ps3000a": "PicoScope 3000", "usbtmc": "USBTMC (SCPI)"}
"""Titles of drivers that ship; any other bears its name."""


class InstrumentsPage(QWidget):
    """Ports and devices with what answered; a row for each role."""

    found = Signal(object)
    tested = Signal(str, bool, str)

    def __init__(self, choice: BenchChoice, theme: Theme) -> None:
        super().__init__()
        self._choice = choice
        self._looked = False
        self.scan = push("Look for instruments")
        self._what = label(
            "Ports are asked only for their name (*IDN?); nothing is set or switched "
            "on.",
            "muted",
            wrap=True,
        )
        self.attached = AttachedList(theme)
        self.coil_port, self.coil_row = self._ports("Coil source port"), Combo()
        self.meter_port, self.meter_row = self._ports("Teslameter port"), Combo()
        self.coil_row.setAccessibleName("Kind of coil source")
        self.meter_row.setAccessibleName("Kind of teslameter")
        self.coil_row.addItems(dialect_ids("coil"))
        self.meter_row.addItems([*dialect_ids("field meter"), BY_PERSON])
        self.scope = Combo()
        self.scope.setAccessibleName("Oscilloscope")
        for driver in driver_names(ScopeDriver):
            self.scope.addItem(SCOPES.get(driver, driver), driver)
        self.scope.addItem("none", "")
        self.serial = line_edit("Serial number", "serial number, if several")
        words = "vendor library, if not in the usual places"
        self.library = line_edit("Vendor library", words)
        self.test_coil = push("Test", name="Test the coil source")
        self.test_meter = push("Test", name="Test the teslameter")
        self.answers = {"coil": label("", wrap=True), "meter": label("", wrap=True)}
        self._lay_out()
        self.meter_row.currentTextChanged.connect(self._allow)
        self.show_choice()
        self.scan.clicked.connect(self.look)
        self.found.connect(self._show_found)
        self.tested.connect(self._show_test)
        self.test_coil.clicked.connect(
            lambda: self._test("coil", self.coil_port, self.coil_row)
        )
        self.test_meter.clicked.connect(
            lambda: self._test("meter", self.meter_port, self.meter_row)
        )

    def show_choice(self) -> None:
        """Show the choice."""
        choice = self._choice
        self.coil_port.setCurrentText(choice.coil_port)
        self.meter_port.setCurrentText(choice.meter_port)
        for box, dialect in (
            (self.coil_row, choice.coil_dialect),
            (self.meter_row, choice.meter_dialect),
        ):
            if box.findText(dialect) < 0:  # a row of the user's own
                box.addItem(dialect)
            box.setCurrentText(dialect)
        if self.scope.findData(choice.scope) < 0:  # a driver of the user's own
            self.scope.addItem(choice.scope, choice.scope)
        self.scope.setCurrentIndex(self.scope.findData(choice.scope))
        self.serial.setText(choice.scope_serial)
        self.library.setText(choice.scope_library)

    def take(self) -> BenchChoice:
        """The choice as it stands."""
        choice = self._choice
        choice.coil_port = self.coil_port.currentText().strip()
        choice.coil_dialect = self.coil_row.currentText()
        choice.meter_port = self.meter_port.currentText().strip()
        choice.meter_dialect = self.meter_row.currentText()
        choice.scope = str(self.scope.currentData())
        choice.scope_serial = self.serial.text().strip()
        choice.scope_library = self.library.text().strip()
        return choice

    def look(self) -> None:
        """Look for ports and devices, away from the window's thread."""
        self._looked = self.scan.hasFocus()
        self.scan.setEnabled(False)
        self.attached.say("Looking …")

        def work() -> None:
            try:
                self.found.emit(attached(ask=True))
            except (TactileLabError, OSError) as error:
                self.found.emit(str(error))

        start(work, "look for instruments")

    def _show_found(self, found: list[dict[str, Any]] | str) -> None:
        self.scan.setEnabled(True)
        if self._looked:  # Qt moved the focus on when the button was locked
            self.scan.setFocus()
        if isinstance(found, str):
            self.attached.say(found)
            return
        self.attached.show_found(found)
        for one in found:
            self._suggest(one)

    def _suggest(self, one: dict[str, Any]) -> None:
        """Offer the port, and choose it where a role has none that it fits."""
        for port in (self.coil_port, self.meter_port):
            if one["kind"] == "serial" and port.findText(one["address"]) < 0:
                chosen = port.currentText()
                port.addItem(one["address"])
                port.setCurrentText(chosen)  # Qt chooses the first item there is
        for fit in one["fits"]:
            if self.coil_row.findText(fit) >= 0 and not self.coil_port.currentText():
                self.coil_port.setCurrentText(one["address"])
                self.coil_row.setCurrentText(fit)
            elif (
                self.meter_row.findText(fit) >= 0 and not self.meter_port.currentText()
            ):
                self.meter_port.setCurrentText(one["address"])
                self.meter_row.setCurrentText(fit)
            elif self.scope.findData(fit) >= 0:
                self.scope.setCurrentIndex(self.scope.findData(fit))
                self.serial.setText(one["identity"] or "")

    def _show_test(self, role: str, good: bool, text: str) -> None:
        answer = self.answers[role]
        set_role(answer, "muted" if good else "error")
        say(answer, text)

    def _test(self, role: str, port: Combo, row: Combo) -> None:
        address, dialect = port.currentText().strip(), row.currentText()
        if not address:
            self._show_test(role, False, "Choose or write a port first.")
            return
        self._show_test(role, True, f"Asking at {address} …")

        def work() -> None:
            try:
                settings = try_out(address, dialect)
                self.tested.emit(role, True, f"✓ {told(settings)}")
            except (TactileLabError, OSError) as error:
                self.tested.emit(role, False, str(error))

        start(work, f"test {role}")

    def _allow(self, row: str) -> None:
        """A teslameter that a person reads has no port."""
        for widget in (self.meter_port, self.test_meter):
            widget.setEnabled(row != BY_PERSON)

    def _ports(self, name: str) -> Combo:
        made = Combo()
        made.setEditable(True)
        made.setCurrentText("")
        made.setAccessibleName(name)
        edit = made.lineEdit()
        if edit is not None:
            edit.setPlaceholderText("none")
        made.setMinimumWidth(200)
        return made

    def _lay_out(self) -> None:
        grid = QGridLayout()
        grid.setHorizontalSpacing(8)
        coil, meter = self.answers["coil"], self.answers["meter"]
        for at, (title, widgets) in enumerate(
            (
                ("Coil source", (self.coil_port, self.coil_row, self.test_coil)),
                ("", (coil,)),
                ("Teslameter", (self.meter_port, self.meter_row, self.test_meter)),
                ("", (meter,)),
                ("Oscilloscope", (self.scope, self.serial)),
                ("", (self.library,)),
            )
        ):
            if title:
                grid.addWidget(label(title, "strong"), at, 0)
            for where, widget in enumerate(widgets):
                last = where == len(widgets) - 1
                span = 4 - len(widgets) if last else 1
                grid.addWidget(widget, at, 1 + where, 1, max(span, 1))
        coil.hide()
        meter.hide()
        grid.setColumnStretch(1, 3)
        grid.setColumnStretch(2, 2)
        top = row(self.scan, (self._what, 1))
        column(self, top, self.attached, line(), grid, STRETCH, spacing=12)


def told(settings: Mapping[str, str]) -> str:
    """Settings that an instrument told, as a sentence: "output off, set-point 0 A"."""
    words = [settings.get("identity", "It answers").replace(",", ", ")]
    for key, value in settings.items():
        if key in ("identity", "dialect", "port"):
            continue
        name, _, unit = key.rpartition("_")
        if name and unit in ("A", "V", "s", "T"):
            key, value = name, show(float(value), unit, 3)
        words.append(f"{key.replace('_', ' ')} {value}")
    return " · ".join(words)
