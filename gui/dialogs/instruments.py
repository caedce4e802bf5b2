"""The connect dialog's first page: look for instruments, choose, test."""

from __future__ import annotations

from importlib import resources
from typing import Any

from PySide6.QtCore import Signal
from PySide6.QtWidgets import QComboBox, QGridLayout, QHBoxLayout, QLineEdit, QWidget

from gui.dialogs.bench_text import BY_PERSON, Choice
from gui.parts import column, label, line, push
from gui.session.threads import start
from tactile_lab.errors import TactileLabError
from tactile_lab.plugins import attached, try_out_device

SCOPES = (("ps3000a", "PicoScope 3000"), ("usbtmc", "USBTMC (SCPI)"), ("", "none"))


def rows_of(kind: str) -> list[str]:
    """Dialect rows for a "coil" or a "meter"."""
    meters = ("lakeshore",)
    folder = resources.files("drivers") / "dialects"
    names = sorted(f.name.removesuffix(".toml") for f in folder.iterdir())
    return [n for n in names if n.startswith(meters) == (kind == "meter")]


class Instruments(QWidget):
    """Ports and devices with what answered; a row for each role."""

    found = Signal(object)
    tested = Signal(str, str)

    def __init__(self, choice: Choice) -> None:
        super().__init__()
        self._choice = choice
        self.scan = push("Look for instruments")
        self._what = label(
            "Ports are asked only for their name (*IDN?); nothing is set or switched "
            "on.",
            "muted",
            wrap=True,
        )
        self.listing = label("", "", wrap=True)
        self.coil_port, self.coil_row = self._ports("Coil source port"), QComboBox()
        self.meter_port, self.meter_row = self._ports("Teslameter port"), QComboBox()
        self.coil_row.addItems(rows_of("coil"))
        self.meter_row.addItems([*rows_of("meter"), BY_PERSON])
        self.scope = QComboBox()
        for driver, title in SCOPES:
            self.scope.addItem(title, driver)
        self.serial = QLineEdit()
        self.serial.setPlaceholderText("serial number, if several")
        self.library = QLineEdit()
        self.library.setPlaceholderText("vendor library, if not in the usual places")
        self.test_coil, self.test_meter = push("Test"), push("Test")
        self._lay_out()
        self.meter_row.currentTextChanged.connect(self._allow)
        self.show_choice()
        self.scan.clicked.connect(self.look)
        self.found.connect(self._show_found)
        self.tested.connect(
            lambda role, text: self.listing.setText(f"<b>{role}</b>: {text}")
        )
        self.test_coil.clicked.connect(
            lambda: self._test("coil source", self.coil_port, self.coil_row)
        )
        self.test_meter.clicked.connect(
            lambda: self._test("teslameter", self.meter_port, self.meter_row)
        )

    def show_choice(self) -> None:
        """Show the choice."""
        choice = self._choice
        self.coil_port.setCurrentText(choice.coil_port)
        self.meter_port.setCurrentText(choice.meter_port)
        for row, dialect in (
            (self.coil_row, choice.coil_dialect),
            (self.meter_row, choice.meter_dialect),
        ):
            if row.findText(dialect) < 0:  # a row of the user's own
                row.addItem(dialect)
            row.setCurrentText(dialect)
        self.scope.setCurrentIndex(max(self.scope.findData(choice.scope), 0))
        self.serial.setText(choice.scope_serial)
        self.library.setText(choice.scope_library)

    def take(self) -> Choice:
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
        self.scan.setEnabled(False)
        self.listing.setText("Looking …")

        def work() -> None:
            try:
                self.found.emit(attached(ask=True))
            except (TactileLabError, OSError) as error:
                self.found.emit(str(error))

        start(work, "look for instruments")

    def _show_found(self, found: list[dict[str, Any]] | str) -> None:
        self.scan.setEnabled(True)
        if isinstance(found, str):
            self.listing.setText(found)
            return
        lines = []
        for one in found:
            name = one["identity"] or one["problem"] or "did not answer"
            fits = ", ".join(one["fits"])
            lines.append(
                f"<b>{one['address']}</b> · {one['title']}<br>{name}"
                + (f" → <b>{fits}</b>" if fits else "")
            )
            self._suggest(one)
        self.listing.setText(
            "<br>".join(lines)
            or "No serial port and no known USB device is attached. "
            "Ports can be written by hand, such as socket://192.168.0.7:5025."
        )

    def _suggest(self, one: dict[str, Any]) -> None:
        for port in (self.coil_port, self.meter_port):
            if one["kind"] == "serial" and port.findText(one["address"]) < 0:
                port.addItem(one["address"])
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

    def _show_test(self, role: str, text: str) -> None:
        self.listing.setText(f"<b>{role}</b>: {text}")

    def _test(self, role: str, port: QComboBox, row: QComboBox) -> None:
        address, dialect = port.currentText().strip(), row.currentText()
        if not address:
            self.tested.emit(role, "choose or write a port first.")
            return
        self.listing.setText(f"Asking the {role} at {address} …")

        def work() -> None:
            try:
                settings = try_out_device(address, dialect)
                words = ", ".join(f"{key} {value}" for key, value in settings.items())
                self.tested.emit(role, f"answers. {words}")
            except (TactileLabError, OSError) as error:
                self.tested.emit(role, str(error))

        start(work, f"test {role}")

    def _allow(self, row: str) -> None:
        """A teslameter that a person reads has no port."""
        for widget in (self.meter_port, self.test_meter):
            widget.setEnabled(row != BY_PERSON)

    def _ports(self, name: str) -> QComboBox:
        made = QComboBox()
        made.setEditable(True)
        made.setCurrentText("")
        made.setAccessibleName(name)
        edit = made.lineEdit()
        if edit is not None:
            edit.setPlaceholderText("none")
        made.setMinimumWidth(200)
        return made

    def _lay_out(self) -> None:
        top = QHBoxLayout()
        top.addWidget(self.scan)
        top.addWidget(self._what, 1)
        grid = QGridLayout()
        grid.setHorizontalSpacing(8)
        for row, (title, widgets) in enumerate(
            (
                ("Coil source", (self.coil_port, self.coil_row, self.test_coil)),
                ("Teslameter", (self.meter_port, self.meter_row, self.test_meter)),
                ("Oscilloscope", (self.scope, self.serial)),
                ("", (self.library,)),
            )
        ):
            grid.addWidget(label(title, "strong"), row, 0)
            for where, widget in enumerate(widgets):
                last = where == len(widgets) - 1
                span = 4 - len(widgets) if last else 1
                grid.addWidget(widget, row, 1 + where, 1, max(span, 1))
        grid.setColumnStretch(1, 3)
        grid.setColumnStretch(2, 2)
        whole = column(self, spacing=12)
        whole.addLayout(top)
        whole.addWidget(self.listing)
        whole.addWidget(line())
        whole.addLayout(grid)
        whole.addStretch(1)
