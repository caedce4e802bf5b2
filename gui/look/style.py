"""The style sheet, built from tokens. Roles are set as the property `role`."""

from __future__ import annotations

from dataclasses import asdict
from string import Template

from gui.look.tokens import Tokens

_SHEET = Template("""
* { font-family: "Inter"; font-size: 13px; color: $text; }
QWidget#page { background: $page; }
QFrame[role="panel"] { background: $panel; border: 1px solid $border;
  border-radius: 8px; }
QFrame[role="card"] { background: $sunken; border: 1px solid $border;
  border-radius: 6px; }
QFrame[role="run"], QFrame[role="run-chosen"] { background: $sunken;
  border: 1px solid $border; border-radius: 6px; padding: 1px 1px 1px 3px; }
QFrame[role="run-chosen"] { border-left: 4px solid $accent; padding-left: 0; }
QFrame[role="run"]:focus, QFrame[role="run-chosen"]:focus {
  border: 2px solid $accent; padding: 0 0 0 2px; }
QFrame[role="card-edited"] { background: $selected; border: 1px solid $accent;
  border-radius: 6px; }
QFrame[role="card"]:focus, QFrame[role="card-edited"]:focus {
  border: 2px solid $accent; }
QFrame[role="lanecard"] { background: $sunken; border: 0;
  border-right: 1px solid $border; }
QFrame[role="line"] { background: $border; border: 0; max-height: 1px;
  min-height: 1px; }
QFrame[role="header"] { background: $header; border: 0; }
QFrame[role="banner"] { background: $red_soft; border: 1px solid $red;
  border-radius: 8px; }
QLabel { background: transparent; border: 0; }
QLabel[role="title"] { font-weight: 600; }
QLabel[role="section"] { font-size: 11px; font-weight: 600; color: $muted;
  letter-spacing: 1px; }
QLabel[role="muted"] { color: $muted; font-size: 12px; }
QLabel[role="small"] { color: $muted; font-size: 11px; }
QLabel[role="value"] { font-size: 17px; font-weight: 600; }
QLabel[role="small"]:disabled, QLabel[role="value"]:disabled { color: $faint; }
QLabel[role="flatvalue"] { font-size: 14px; font-weight: 600; }
QLabel[role="strong"] { font-weight: 600; }
QLabel[role="error"] { color: $red; font-size: 12px; }
QLabel[role="warning"] { color: $amber; font-size: 12px; }
QLabel[role="big"] { font-size: 18px; font-weight: 600; }
QLabel[role="bannertitle"] { color: $red; font-weight: 600; }
QLabel[role^="pill"] { border-radius: 9px; padding: 2px 9px; font-size: 11px;
  font-weight: 600; }
QLabel[role="pill-ok"] { background: $green_soft; color: $green; }
QLabel[role="pill-warn"] { background: $amber_soft; color: $amber; }
QLabel[role="pill-bad"] { background: $red_soft; color: $red; }
QLabel[role="pill"] { background: $selected; color: $selected_text; }
QLabel[role="strip"] { background: $selected; color: $selected_text;
  border-radius: 6px; padding: 5px 9px; font-size: 12px; }
QLabel[role="strip-warn"] { background: $amber_soft; color: $amber;
  border-radius: 6px; padding: 5px 9px; font-size: 12px; }
QLabel[role="hname"] { color: $header_text; font-weight: 600; }
QLabel[role="hidentity"] { color: $header_text; font-weight: 600; font-size: 15px; }
QLabel[role="hsub"] { color: $header_muted; font-size: 11px; }
QLabel[role="hvalue"] { color: $header_text; font-weight: 600; font-size: 15px; }
QLabel[role="sim"] { background: #F5A524; color: #241500; font-weight: 700;
  font-size: 10px; border-radius: 3px; padding: 3px 7px; letter-spacing: 1px; }

QPushButton, QToolButton { background: $panel; border: 1px solid $control;
  border-radius: 6px; padding: 5px 12px; min-height: 20px; font-weight: 500; }
QPushButton:hover, QToolButton:hover { background: $sunken; border-color: $accent; }
QPushButton:pressed, QToolButton:pressed { background: $selected; }
QPushButton:focus, QToolButton:focus { border: 2px solid $accent; padding: 4px 11px; }
QPushButton:disabled, QToolButton:disabled { color: $faint; background: $sunken;
  border-color: $border; }
QPushButton[role="primary"] { background: $accent; color: $on_accent;
  border: 1px solid $accent; font-weight: 600; }
QPushButton[role="primary"]:hover { background: $accent_hover; }
QPushButton[role="primary"]:focus { border: 1px solid $accent; padding: 5px 12px; }
QPushButton[role="primary"]:disabled { background: $selected; color: $faint;
  border-color: $selected; }
QPushButton[role="danger"] { color: $red; border: 1px solid $red; font-weight: 600; }
QPushButton[role="danger"]:disabled { color: $faint; border-color: $border; }
QPushButton[role="danger"]:hover { background: $red_soft; }
QPushButton[role="danger"]:focus { border: 2px solid $red; padding: 4px 11px; }
QFileDialog QToolButton, QFileDialog QToolButton:focus { padding: 2px;
  background: #DCE3EC; } /* Qt's own pictures are dark in both themes */
QToolButton[role="flat"] { background: transparent; border: 1px solid transparent;
  padding: 4px; }
QToolButton[role="flat"]:hover { background: $sunken; border-color: $border; }
QToolButton[role="flat"]:focus { border: 2px solid $accent; padding: 3px; }
QToolButton[role="hflat"] { background: transparent; border: 1px solid transparent;
  padding: 4px; }
QToolButton[role="hflat"]:hover { background: $header_chip; }
QToolButton[role="hflat"]:focus { border: 2px solid #5AA9FF; padding: 3px; }
QToolButton[role="toggle"] { background: transparent; border: 1px solid transparent;
  padding: 5px 9px; }
QToolButton[role="toggle"][alone="true"] { padding: 4px; }
QToolButton[role="toggle"]:hover { background: $sunken; border-color: $border; }
QToolButton[role="toggle"]:checked { background: $selected; color: $selected_text;
  border-color: $selected; }
QToolButton[role="toggle"]:disabled, QToolButton[role="toggle"]:checked:disabled {
  background: transparent; color: $faint; border-color: transparent; }
QToolButton[role="toggle"]:focus { border: 2px solid $accent; padding: 4px 8px; }
QFrame[role="segments"] { background: $sunken; border: 1px solid $border;
  border-radius: 6px; }
QToolButton[role="segment"] { background: transparent; border: 1px solid transparent;
  border-radius: 5px; padding: 3px 9px; }
QToolButton[role="segment"]:checked { background: $panel;
  border: 1px solid $control; font-weight: 600; }
QToolButton[role="segment"]:focus { border: 2px solid $accent; padding: 2px 8px; }
QToolButton[role="section"] { background: transparent; border: 1px solid transparent;
  padding: 3px 4px; font-size: 11px; font-weight: 600; color: $muted; }
QToolButton[role="section"]:hover { color: $text; }
QToolButton[role="section"]:focus { border: 2px solid $accent; padding: 2px 3px; }
QToolButton[role="tab"] { background: transparent; border: 0; border-radius: 0;
  border-bottom: 2px solid transparent; padding: 8px 7px; color: $muted;
  font-weight: 500; }
QToolButton[role="tab"]:hover { color: $text; }
QToolButton[role="tab"]:checked { color: $text; border-bottom: 2px solid $accent;
  font-weight: 600; }
QToolButton[role="tab"]:focus { border: 2px solid $accent; border-radius: 5px;
  padding: 6px 5px 8px 5px; }

QLineEdit, QComboBox { background: $field;
  border: 1px solid $control; border-radius: 6px; padding: 3px 8px;
  min-height: 22px; selection-background-color: $accent;
  selection-color: $on_accent; }
QLineEdit { placeholder-text-color: $muted; }
QLineEdit:focus, QComboBox:focus {
  border: 2px solid $accent; padding: 2px 7px; }
QLineEdit:disabled, QComboBox:disabled {
  background: $sunken; color: $muted; border-color: $border; }
QLineEdit[invalid="true"] { border: 2px solid $red; padding: 2px 7px; }
QComboBox { combobox-popup: 0; }
QComboBox::drop-down { border: 0; width: 22px; }
QComboBox::down-arrow { image: url("$arrow"); width: 12px; height: 12px; }
QComboBox QAbstractItemView { background: $panel; border: 1px solid $border_strong;
  selection-background-color: $selected; selection-color: $selected_text;
  outline: 0; padding: 4px; }
QComboBox QAbstractItemView::item { min-height: 24px; }
QCheckBox { spacing: 8px; background: transparent; border: 2px solid transparent;
  border-radius: 6px; padding: 1px; }
QCheckBox:focus { border-color: $accent; }
QCheckBox::indicator { width: 16px; height: 16px; border: 1px solid $muted;
  border-radius: 4px; background: $field; }
QCheckBox::indicator:checked { background: $accent; border-color: $accent;
  image: url("$check"); }

QScrollArea, QScrollArea > QWidget > QWidget { background: transparent; border: 0; }
QScrollBar:vertical { background: transparent; width: 10px; margin: 0; }
QScrollBar::handle:vertical { background: $control; border-radius: 4px;
  min-height: 30px; margin: 1px 2px; }
QScrollBar:horizontal { background: transparent; height: 10px; margin: 0; }
QScrollBar::handle:horizontal { background: $control; border-radius: 4px;
  min-width: 30px; margin: 2px 1px; }
QScrollBar::add-line, QScrollBar::sub-line { width: 0; height: 0; }
QScrollBar::add-page, QScrollBar::sub-page { background: transparent; }
QTableView { background: transparent; border: 2px solid transparent;
  border-radius: 6px; gridline-color: $border;
  selection-background-color: $selected; selection-color: $text; outline: 0; }
QTableView::item { padding: 0 3px; border: 0; }
QTableView:focus { border-color: $accent; }
QHeaderView { background: transparent; border: 0; }
QHeaderView::section { background: transparent; border: 0;
  border-bottom: 1px solid $border; color: $muted; font-size: 11px;
  font-weight: 600; padding: 4px 6px; }
QListView { background: transparent; border: 2px solid transparent;
  border-radius: 6px; outline: 0; }
QListView:focus { border-color: $accent; }
QMenu { background: $panel; border: 1px solid $border_strong; padding: 5px;
  menu-scrollable: 1; }
QMenu::item { padding: 6px 22px; border-radius: 4px; }
QMenu::item:selected { background: $selected; color: $selected_text; }
QMenu::item:disabled { color: $faint; }
QMenu::separator { height: 1px; background: $border; margin: 5px 8px; }
QToolTip { background: $header; color: $header_text; border: 1px solid $header_border;
  padding: 5px 8px; }
QDialog, QFrame[role="dialog"] { background: $panel; }
QFrame[role="dialog"] { border: 1px solid $border_strong; border-radius: 10px; }
QSplitter::handle { background: transparent; }
QSplitter::handle:hover { background: $selected; }
QProgressBar { background: $sunken; border: 0; border-radius: 3px; max-height: 6px;
  min-height: 6px; }
QProgressBar::chunk { background: $accent; border-radius: 3px; }
QSlider { min-height: 22px; background: transparent; }
QSlider::groove:horizontal { background: $control; height: 4px;
  border-radius: 2px; }
QSlider::handle:horizontal { background: $accent; border: 2px solid $panel;
  width: 16px; height: 16px; margin: -8px 0; border-radius: 10px; }
QSlider::handle:horizontal:focus { border-color: $text; }
QSlider::handle:horizontal:disabled { background: $border_strong; }
QTextBrowser { background: $panel; border: 0; }
""")


def sheet(tokens: Tokens) -> str:
    """The application's style sheet in these colours."""
    from gui.look.icons import file_of

    return _SHEET.substitute(
        asdict(tokens),
        arrow=file_of("chevron", tokens.muted),
        check=file_of("tick", tokens.on_accent),
    )
