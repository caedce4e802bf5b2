"""One run as it is listed: what `run.json` and people say of it, without samples."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tactile_lab.store.folder import DATA

if TYPE_CHECKING:
    from tactile_lab.store.run import Run


@dataclass(frozen=True, kw_only=True)
class RunSummary:
    """One run in the catalogue, without its samples.

    Attributes:
        folder: of the run.
        name: of the folder.
        started: ISO time with zone.
        status: as in `run.json`; "cut short" where a running run has no writer, "data
            gone" where the file of its samples was moved or deleted.
        title: that somebody gave it, else that of its protocol.
        protocol, scene, sensor, operator, bench: names; empty where not known.
        tags, notes: what people said of it.
        starred: it matters to somebody.
        parameters: of the protocol, as a file holds them; empty for older runs.
        simulated: whether physics was computed.
        duration: of the experiment, s; None if not known.
        spikes: found on line; None if not known.
        uncounted: whether those of a trial were seen, and are no count; False for runs
            of older versions.
        loss: the certificate's line; empty if there is none.
        trouble: why the run cannot be read; empty where it can.
    """

    folder: Path
    name: str
    started: str = ""
    status: str = "unreadable"
    title: str = ""
    protocol: str = ""
    scene: str = ""
    sensor: str = ""
    operator: str = ""
    bench: str = ""
    tags: Sequence[str] = ()
    notes: Sequence[str] = ()
    starred: bool = False
    parameters: Mapping[str, Any] = field(default_factory=dict)
    simulated: bool | None = None
    duration: float | None = None
    spikes: int | None = None
    uncounted: bool = False
    loss: str = ""
    trouble: str = ""

    @property
    def recorded(self) -> bool:
        """Whether its samples are there, or were."""
        return self.status == "data gone" or (self.folder / DATA).exists()

    def load(self) -> Run:
        """The run itself, opened for reading.

        Raises:
            RunFolderError: it cannot be read, or ended before its first sample.
        """
        from tactile_lab.store.run import Run

        return Run.load(self.folder)

    def says(self, words: str) -> bool:
        """Whether each of `words`, in any case, stands in a name, note or parameter."""
        texts = (
            *(self.name, self.status, self.title, self.protocol, self.scene),
            *(self.sensor, self.operator, self.bench, *self.tags, *self.notes),
            *(f"{key}={value}" for key, value in self.parameters.items()),
        )
        text = " ".join(texts).casefold()
        return all(word in text for word in words.casefold().split())

    def to_dict(self) -> dict[str, Any]:
        """All but the folder, for the index and for JSON."""
        names = (field.name for field in fields(self))
        return {name: getattr(self, name) for name in names if name != "folder"}
