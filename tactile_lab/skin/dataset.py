"""A benchmark data set: touches on one skin, whose spikes a decoder has to tell apart.

Four tasks, each with its own touches: how strong a ball presses, at which angle an edge
lies, how coarse a texture slides by, whether a ball slips. Place, strength and all else
that does not make the answer is drawn anew for every touch, from a seed.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

from tactile_lab.arrays import FloatArray
from tactile_lab.errors import RunFolderError
from tactile_lab.skin.blocks import solve_block
from tactile_lab.skin.bound import spans
from tactile_lab.skin.events import recording
from tactile_lab.skin.forces import Loads
from tactile_lab.skin.skin import Skin, load_skin
from tactile_lab.whole_file import replacing

FILE = "touches.h5"
DURATION = 0.6
"""Of each touch, s."""
SENSOR = {"V_GS": "1.5 V"}
"""Table 1 with a gate voltage at which some 30 mN on a taxel bring it to threshold."""
ARRAY = {"grid": [8, 8], "pitch": "1.5 mm"}
LABELS: Mapping[str, tuple[str, ...]] = {
    "press": ("0.6 N", "0.9 N", "1.35 N", "2 N"),
    "edge": tuple(f"{angle:g} deg" for angle in np.arange(8) * 22.5),
    "texture": ("2 mm", "3 mm", "4.5 mm", "7 mm"),
    "slip": ("stays", "slips"),
}
"""Answers of each task."""


def stimulus(task: str, label: str, drawn: np.random.Generator) -> dict[str, Any]:
    """One touch: its label, and all else at random."""
    x, y = drawn.uniform(-2, 2, 2)
    strong = drawn.uniform(0.85, 1.15)
    one: dict[str, Any] = {
        "at": [f"{x} mm", f"{y} mm"], "start": f"{drawn.uniform(10, 50)} ms",
        "ramp": "20 ms", "hold": "0.5 s",
    }  # fmt: skip
    way = f"{drawn.uniform(0, 360)} deg"
    if task == "press":
        force = f"{float(label.removesuffix(' N')) * strong} N"
        return {**one, "kind": "sphere", "force": force}
    if task == "edge":
        angle = float(label.removesuffix(" deg")) + drawn.uniform(-8, 8)
        return {
            **one, "kind": "grating", "ridges": 1, "ridge": "1.5 mm",
            "pressure": f"{100 * strong} kPa", "angle": f"{angle} deg",
        }  # fmt: skip
    if task == "texture":
        longest = 1.2 * float(label.removesuffix(" mm"))
        return {
            **one, "kind": "texture", "pressure": f"{60 * strong} kPa",
            "roughness": 0.3, "longest": f"{longest} mm",
            "shortest": f"{longest / 1.44} mm", "seed": int(drawn.integers(1 << 31)),
            "speed": "20 mm/s", "towards": way,
        }  # fmt: skip
    moves = {"speed": "10 mm/s", "towards": way} if label == "slips" else {}
    moves |= {"rests": f"{drawn.uniform(0.15, 0.3)} s"}
    return {**one, "kind": "sphere", "force": f"{1.5 * strong} N", **moves}


def touch(seed: int, task: str, number: int) -> Skin:
    """The skin under one touch; the same numbers always give the same one.

    Args:
        seed: of the data set: of the specimens and of what is drawn.
        task: one of `LABELS`.
        number: of the touch; its label is the remainder of that.
    """
    labels = LABELS[task]
    drawn = np.random.default_rng([seed, list(LABELS).index(task), number])
    return load_skin(
        {
            "duration": f"{DURATION} s",
            "sensor": SENSOR,
            "array": ARRAY,
            "seed": seed,
            "stimulus": [stimulus(task, labels[number % len(labels)], drawn)],
        },
        f"{task} {number}",
    )


@dataclass(frozen=True, eq=False)
class Dataset:
    """All touches: those of a task one after the other, training before test.

    Attributes:
        time: of all spikes, s, in order of time within a touch.
        taxel: of each spike.
        first: of each touch its first spike; touch i has those to `first[i + 1]`.
        task: of each touch, a number of `LABELS`' keys.
        label: of each touch, a number of its task's labels.
        test: whether it is of the test part.
        places: of the taxels, m, shape (taxels, 2).
        seed: of all.
    """

    time: FloatArray
    taxel: NDArray[np.int32]
    first: NDArray[np.int64]
    task: NDArray[np.int8]
    label: NDArray[np.int8]
    test: NDArray[np.bool_]
    places: FloatArray
    seed: int

    def chosen(self, task: str, *, test: bool) -> NDArray[np.intp]:
        """Numbers of the touches of one part of a task."""
        mine = self.task == list(LABELS).index(task)
        return np.flatnonzero(mine & (self.test == test))

    def counts(self, touches: NDArray[np.intp]) -> FloatArray:
        """Spikes of each taxel, shape (touches, taxels)."""
        return self._of_each(touches, lambda _, taxel, n: np.bincount(taxel, None, n))

    def latencies(self, touches: NDArray[np.intp]) -> FloatArray:
        """Time of each taxel's first spike, s, `DURATION` where there is none."""

        def earliest(time: FloatArray, taxel: NDArray[np.int32], n: int) -> FloatArray:
            found = np.full(n, DURATION)
            found[taxel[::-1]] = time[::-1]  # the first is written last
            return found

        return self._of_each(touches, earliest)

    def train(self, touch: int, taxel: int) -> FloatArray:
        """Spike times of one taxel in one touch, s."""
        part = slice(self.first[touch], self.first[touch + 1])
        found: FloatArray = self.time[part][self.taxel[part] == taxel]
        return found

    def _of_each(
        self, touches: NDArray[np.intp], asked: Callable[..., Any]
    ) -> FloatArray:
        n = self.places.shape[0]
        parts = [slice(self.first[i], self.first[i + 1]) for i in touches]
        return np.array([asked(self.time[p], self.taxel[p], n) for p in parts], float)

    @classmethod
    def read(cls, folder: str | Path) -> Dataset:
        """A data set that was made.

        Raises:
            RunFolderError: the folder holds none.
        """
        try:
            with h5py.File(Path(folder) / FILE, "r") as file:
                arrays = {name: file[name][:] for name in file}
                return cls(**arrays, seed=int(file.attrs["seed"]))
        except (OSError, KeyError, TypeError) as reason:
            raise RunFolderError(f"{folder} holds no data set: {reason}.") from reason

    def write(self, folder: Path) -> None:
        """Write `touches.h5`.

        Raises:
            RecordingError: it cannot be written.
        """
        with (
            recording(),
            replacing(folder / FILE) as part,
            h5py.File(part, "w") as file,
        ):
            for name, values in vars(self).items():
                if name != "seed":
                    file.create_dataset(
                        name, data=values, compression="gzip", shuffle=True
                    )
            file.attrs["seed"] = self.seed
            file.attrs["duration_s"] = DURATION
            file.attrs["labels"] = json.dumps(LABELS)


def make(
    seed: int,
    touches: int,
    *,
    cores: int | None = None,
    tell: Callable[[int], object] = lambda touches: None,
) -> Dataset:
    """Press every touch; the same to the last bit on any cores.

    Args:
        seed: of all.
        touches: of each task and each of its parts, training and test.
        cores: threads; as many as cores unless given.
        tell: is told how many touches are done.
    """
    asked = [(task, number) for task in LABELS for number in range(2 * touches)]
    found = []
    with ThreadPoolExecutor(cores) as pool:
        solved = pool.map(partial(_spikes, seed), *zip(*asked, strict=True))
        for done, one in enumerate(solved, 1):
            found.append(one)
            tell(done)
    numbers = np.array([number for _, number in asked])
    labels = np.array([len(LABELS[task]) for task, _ in asked])
    return Dataset(
        time=np.concatenate([time for time, _ in found]),
        taxel=np.concatenate([taxel for _, taxel in found]),
        first=np.cumsum([0, *(time.size for time, _ in found)]),
        task=np.repeat(np.arange(len(LABELS), dtype=np.int8), 2 * touches),
        label=(numbers % labels).astype(np.int8),
        test=numbers >= touches,
        places=touch(seed, "press", 0).array.places,
        seed=seed,
    )


def _spikes(seed: int, task: str, number: int) -> tuple[FloatArray, NDArray[np.int32]]:
    skin = touch(seed, task, number)
    n, loads = skin.array.size, Loads(skin)
    role, (span, _) = np.zeros(n, np.uint8), spans(skin, loads)
    found = solve_block(loads, slice(0, n), role, span)
    taxel = np.repeat(np.arange(n, dtype=np.int32), found.spikes)
    order = np.lexsort((taxel, found.times))
    return found.times[order], taxel[order]
