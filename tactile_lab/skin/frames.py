"""``kind = "frames"``: the force on every taxel from a file of arrays."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Annotated, ClassVar

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from tactile_lab.arrays import FloatArray
from tactile_lab.errors import SceneError
from tactile_lab.quantity import Pause, SampleRate
from tactile_lab.skin.layout import Array
from tactile_lab.table import SceneTable

CHECKED = 1 << 22
"""Numbers looked at in one go: a file may be larger than the memory."""


@dataclass(frozen=True, kw_only=True)
class Frames(SceneTable):
    """Frames of forces, linear in between; before the first and after the last held.

    Attributes:
        file: a .npy of shape (frames, taxels) or (frames, rows, columns), N.
        rate: frames a second.
        start: when the first frame is, s.
        scale: what each force is multiplied by.
    """

    kind: ClassVar[str] = "frames"
    file: Annotated[str, Field(min_length=1)]
    rate: SampleRate = 1e3
    start: Pause = 0.0
    scale: Annotated[float, Field(gt=0)] = 1.0

    @cached_property
    def forces(self) -> FloatArray:
        """What the file holds, shape (frames, taxels), N; not read into memory.

        Raises:
            SceneError: it is no such file.
        """
        try:
            found = np.load(Path(self.file), mmap_mode="r", allow_pickle=False)
        except FileNotFoundError as reason:
            raise SceneError(f"{self.file} does not exist.") from reason
        except ValueError as reason:
            raise SceneError(
                f"{self.file} is no .npy file of plain numbers; write one with "
                "numpy.save (what a .mat file holds, scipy.io.loadmat reads)."
            ) from reason
        except (OSError, EOFError) as reason:
            raise SceneError(f"{self.file} is no .npy file: {reason}.") from reason
        if not isinstance(found, np.ndarray):
            raise SceneError(f"{self.file} is an archive; give one array as .npy.")
        numbers = found.dtype.kind in "fiu" and 0 not in found.shape
        if found.ndim not in (2, 3) or not numbers:
            raise SceneError(
                f"{self.file} holds {found.dtype} of shape {found.shape}; forces of "
                "shape (frames, taxels) or (frames, rows, columns) are needed."
            )
        flat: FloatArray = found.reshape(found.shape[0], -1)
        return flat

    def checked(self, array: Array) -> None:
        """Read it once, a piece at a time.

        Raises:
            SceneError: another number of taxels, or a force that is not finite.
        """
        shape = self.forces.shape
        if shape[1] != array.size:
            raise SceneError(
                f"{self.file} has forces for {shape[1]} taxels; the array has "
                f"{array.size}."
            )
        for first, piece in self._pieces():
            bad = np.argwhere(~np.isfinite(piece))
            if bad.size:
                frame, taxel = int(bad[0, 0]) + first, int(bad[0, 1])
                raise SceneError(
                    f"{self.file}: the force on taxel {taxel} in frame {frame} is "
                    f"{self.forces[frame, taxel]}; give finite forces."
                )

    @cached_property
    def range(self) -> tuple[FloatArray, FloatArray]:
        """The least and the largest force on each taxel, N; read a piece at a time."""
        low, high = np.inf, -np.inf
        for _, piece in self._pieces():
            low = np.minimum(low, piece.min(axis=0))
            high = np.maximum(high, piece.max(axis=0))
        return np.asarray(low) * self.scale, np.asarray(high) * self.scale

    def _pieces(self) -> Iterator[tuple[int, FloatArray]]:
        """The number of its first frame, and a piece of the file."""
        frames, taxels = self.forces.shape
        rows = max(1, CHECKED // taxels)
        for first in range(0, frames, rows):
            yield first, self.forces[first : first + rows]

    @property
    def times(self) -> FloatArray:
        """When each frame is, s."""
        return self.start + np.arange(self.forces.shape[0]) / self.rate

    def at(self, time: FloatArray, taxels: NDArray[np.intp]) -> FloatArray:
        """The force on these taxels, shape (taxels, time), N."""
        frames = np.asarray(self.forces[:, taxels], dtype=np.float64) * self.scale
        place = np.clip((time - self.start) * self.rate, 0, frames.shape[0] - 1)
        low = np.minimum(place.astype(int), max(frames.shape[0] - 2, 0))
        high = np.minimum(low + 1, frames.shape[0] - 1)
        part = (place - low)[:, None]
        return np.ascontiguousarray(((1 - part) * frames[low] + part * frames[high]).T)
