"""What a user prefers, kept from one start to the next."""

from __future__ import annotations

from os.path import expanduser
from pathlib import Path
from typing import Any

from PySide6.QtCore import QObject, QSettings, Signal

from tactile_lab.lab import Lab

MOST = 8
"""Recent scenes and benches that are kept."""

DEFAULTS: dict[str, Any] = {
    "folder": "",
    "bench": "",
    "sound": False,
    "monitor": False,
    "reports": True,
    "lsl": False,
    "last_bench": "",
    "lanes": "",
}


class Preferences(QObject):
    """Kept by the desktop's own means; in memory alone where nothing is to be kept.

    Args:
        settings: where they are kept; None keeps nothing.
        lab: what counts where nothing was chosen.
        out: folder for runs that the command line names; it wins.
    """

    changed = Signal()

    def __init__(
        self,
        settings: QSettings | None = None,
        lab: Lab | None = None,
        out: Path | None = None,
    ) -> None:
        super().__init__()
        self._out = out
        self._lab = lab or Lab()
        self._settings = settings
        self._values = dict(DEFAULTS)
        self._recent: list[str] = []
        if settings is not None:
            for key, default in DEFAULTS.items():
                kept = settings.value(f"preferences/{key}", default)
                # some desktops keep texts only
                is_switch = isinstance(default, bool)
                self._values[key] = (
                    str(kept).lower() == "true" if is_switch else str(kept)
                )
            self._recent = str(settings.value("recent", "")).split("\n")

    @property
    def folder(self) -> Path:
        """For runs: of the command line, else as it was chosen, else the lab's."""
        return self._out or self.chosen_folder

    @property
    def chosen_folder(self) -> Path:
        """For runs, where the command line names none."""
        return Path(self._values["folder"] or self._lab.runs)

    @property
    def bench(self) -> str:
        """Bench file that is connected at the start, "sim", or "none".

        Where none was chosen it is the one that answered last, if it is still there,
        else the lab's.
        """
        last = str(self._values["last_bench"])
        return self.chosen_bench or (last if Path(last).is_file() else self._lab.bench)

    @property
    def chosen_bench(self) -> str:
        """Bench to be connected at the start, as it was chosen; "" for the last."""
        return str(self._values["bench"])

    @property
    def scene(self) -> str | None:
        """Scene to begin with: the one that was opened last; None for the demo."""
        return next((str(path) for path in self.recent), None)

    def wants(self, switch: str) -> bool:
        """Whether "sound", "monitor", "reports" or "lsl" is switched on."""
        return bool(self._values[switch])

    @property
    def recent(self) -> list[Path]:
        """Scenes opened last, the newest first, as far as they are still there."""
        return [path for path in map(Path, self._recent) if path.is_file()]

    def set(self, **values: str | bool) -> None:
        """Change some; all are kept."""
        self.keep(**values)
        self.changed.emit()

    def keep(self, **values: str | bool) -> None:
        """Keep what was seen of the user; nothing follows from it now."""
        self._values |= values
        if self._settings is not None:
            for key, value in values.items():
                self._settings.setValue(f"preferences/{key}", value)

    @property
    def lanes(self) -> str:
        """How the lanes were left: the text of an `Arrangement`; "" at first."""
        return str(self._values["lanes"])

    def remember(self, scene: str) -> None:
        """A scene file was opened."""
        path = str(Path(scene).resolve())
        self._recent = [path, *(one for one in self._recent if one != path)][:MOST]
        if self._settings is not None:
            self._settings.setValue("recent", "\n".join(self._recent))


def from_anywhere(bench: str) -> str:
    """A bench, found from any working folder: the next start may have another."""
    return bench if bench == "sim" else str(Path(expanduser(bench)).absolute())
