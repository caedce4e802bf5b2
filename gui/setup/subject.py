"""What the form is about: the next run, or a run that waits in the queue."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from PySide6.QtCore import QObject, Signal

from gui.session.queue import Queued
from gui.session.session import Session
from gui.setup.form import Form
from gui.setup.sections import LASTING, TITLES, Sections
from tactile_lab.engine.request import Request
from tactile_lab.errors import TactileLabError
from tactile_lab.scene.load import load
from tactile_lab.scene.scene import Scene
from tactile_lab.trial import Protocol


@dataclass(frozen=True)
class LeftForm:
    """What stood in the form when another protocol was picked.

    Attributes:
        path: the scene it was opened from.
        texts: of the protocol's fields.
        tables: of the fields of its tables that differ from the usual.
    """

    path: str | None
    texts: dict[str, str]
    tables: dict[str, dict[str, str]]


@dataclass(frozen=True, eq=False)
class KeptForm:
    """What stood in the form before a queued run was taken up."""

    path: str | None
    protocol: type[Protocol] | None
    texts: dict[str, str]
    usual: Scene | None
    tables: dict[str, dict[str, str]]


class Subject(QObject):
    """Fills the form, and makes a request of it.

    Attributes:
        edited: the waiting run whose parameters stand in the form; None for the next.
        lost: what became of an edited run that left the queue, "" if none did.
    """

    changed = Signal()

    def __init__(self, session: Session, form: Form, tables: Sections) -> None:
        super().__init__(form)
        self.edited: Queued | None = None
        self.lost = ""
        self.path: str | None = None
        self._session, self._form, self._tables = session, form, tables
        self._usual: Scene | None = None
        self._before = KeptForm(None, None, {}, None, {})
        self._taken_up: object = None
        self._left: dict[str, LeftForm] = {}
        session.queue.changed.connect(self._mind_queue)

    def open(self, path: str | None, overrides: tuple[str, ...] = ()) -> None:
        """Fill the form with a scene; an edit of a queued run is given up.

        Raises:
            SceneError: it cannot be used.
        """
        self._remember()
        scene = load(None if path is None else Path(path), overrides)
        given_up = self.edited if self.touched else None
        self.edited = None
        words = "" if given_up is None else f"{given_up.title} waits unchanged."
        self._fill(path, scene, words)

    def pick(self, path: str) -> None:
        """Fill the form with a protocol's ready scene, or as that protocol was left.

        Raises:
            SceneError: it cannot be used; where the file it was left with is gone, the
                ready scene is in the form.
        """
        self.open(path)
        kind = self._form.protocol
        left = None if kind is None else self._left.pop(kind.name, None)
        if left is not None:
            if left.path != path:
                self.open(left.path)
            self._form.propose(left.texts)
            self._tables.propose(left.tables)

    def follow_bench(self) -> None:
        """Another bench is connected: its limits and voltages are the usual ones."""
        if self.edited is None and self._usual is not None:
            before = self._tables.changed_texts()
            scene = self._on_bench(self.path)
            self._tables.show_scene(scene, scene)
            self._tables.set_texts(before)
            self._usual = scene

    def request(self) -> Request:
        """What the form asks for, on the connected bench.

        What a queued run was asked beside its parameters stays, unless it was asked of
        another bench.

        Raises:
            FieldError: a field cannot be used.
        """
        session = self._session
        texts = [*self._form.overrides(), *self._tables.overrides()]
        asked = None if self.edited is None else self.edited.request
        if asked is None or asked.bench != session.bench.choice:
            path = self.path if asked is None else asked.path
            overrides = (*texts, *session.bench.overrides)
            return Request(path, overrides, session.bench.choice)
        own = ("protocol.", *(f"{name}." for name in TITLES))
        rest = [text for text in asked.overrides if not text.startswith(own)]
        return Request(asked.path, (*texts, *rest), asked.bench)

    @property
    def touched(self) -> bool:
        """Whether the edited run's parameters were changed in the form."""
        return self.edited is not None and self._all_texts() != self._taken_up

    def _all_texts(self) -> object:
        return self._form.texts(), self._tables.texts()

    def _remember(self) -> None:
        """Keep what stands in the form for when its protocol is picked again."""
        kind = self._form.protocol
        if kind is not None and self.edited is None:
            tables = self._tables.changed_texts()
            del tables[LASTING]  # as it is by then
            self._left[kind.name] = LeftForm(self.path, self._form.texts(), tables)

    def _on_bench(self, path: str | None) -> Scene:
        """A scene as it is on the connected bench, or as it is where it cannot be."""
        session = self._session
        try:
            overrides = session.bench.overrides
            return Request(path, overrides, session.bench.choice).load()
        except (TactileLabError, OSError):
            return load(None if path is None else Path(path))

    def words(self, *, busy: bool, shown: bool) -> str:
        """What the form is about; "" where it simply holds the next run's parameters.

        Args:
            busy: whether a run is in progress.
            shown: whether that run is the one in the form.
        """
        item, queue = self.edited, self._session.queue.items
        if item is not None:
            place = f"{queue.index(item) + 1} of {len(queue)} in the queue"
            return f"Editing {item.title}, {place}"
        if self.lost or not busy:
            return self.lost
        if shown:
            return "As the run in progress · change it for the next"
        return f"Your next run · {self._session.run.title} is in progress"

    def edit(self, item: Queued) -> str:
        """Take up a waiting run's parameters; why not, "" if they stand in the form."""
        if item is self.edited:
            return ""
        if self.edited is not None and self.touched:
            return f"First save or cancel the changes to {self.edited.title}."
        try:
            scene = item.request.load()
        except (TactileLabError, OSError) as error:
            return f"{item.title} cannot be edited: {error}"
        if self.edited is None:
            self._before = KeptForm(
                self.path,
                self._form.protocol,
                self._form.texts(),
                self._usual,
                self._tables.texts(),
            )
        self.edited = item
        self._fill(item.request.path, scene)
        self._taken_up = self._all_texts()
        return ""

    def leave(self) -> None:
        """Put back what stood in the form before the edit."""
        if self.edited is None:
            return
        self.edited, before = None, self._before
        self.path = before.path
        if before.protocol is not None:
            self._form.show_protocol(before.protocol, {})
            self._form.set_texts(before.texts)
        if before.usual is not None:
            self._usual = before.usual
            self._tables.show_scene(before.usual, before.usual)
            self._tables.set_texts(before.tables)
        self.changed.emit()

    def _fill(self, path: str | None, scene: Scene, lost: str = "") -> None:
        self.path = path
        kind = type(scene.protocol)
        values = stated(scene)
        self._form.show_protocol(kind, values)
        self._usual = self._on_bench(path)
        own = self._usual if self.edited is None else scene
        self._tables.show_scene(own, self._usual)
        self.lost = lost
        self.changed.emit()

    def _mind_queue(self) -> None:
        """An edited run that has left the queue: what was changed stays in the form."""
        item = self.edited
        if item is None or item in self._session.queue.items:
            return
        words = f"{item.title} {item.left}."
        if self.touched:
            self.edited = None
            words += " Your changes stay in the form: Queue makes a new run of them."
            self.changed.emit()
        else:
            self.leave()
        self.lost = words


def stated(scene: Scene) -> dict[str, Any]:
    """Values of a scene's protocol; None for what it takes from the sensor."""
    asked, sensor = scene.protocol, scene.sensor
    values = {key: getattr(asked, key) for key in type(asked).model_fields}
    for key, info in type(asked).model_fields.items():
        if values[key] is None or info.default is not None:
            continue
        bare = asked.model_copy(update={key: None})
        if getattr(bare.on_sensor(sensor.tau, abs(sensor.k_F)), key) == values[key]:
            values[key] = None
    return values
