"""The data set of a study: labelled axes, what is kept, why points failed."""

from __future__ import annotations

import json
import shutil
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import tomli_w
from numpy.typing import NDArray

from tactile_lab.arrays import FloatArray
from tactile_lab.studies.addresses import study_digest
from tactile_lab.studies.axes import Axis
from tactile_lab.studies.column import Column, Rows
from tactile_lab.studies.shelf import Places, Shelf
from tactile_lab.studies.study import Study

if TYPE_CHECKING:
    import xarray

DATA = "data.zarr"
KEPT = "All points are kept; make room and start the study again."
"""What to do where the disk fails."""
MADE_OF = "made_of"
"""Attribute that tells of which study a data set is; see `study_digest`."""


@dataclass(frozen=True, eq=False)
class Gathered:
    """What a study found.

    Attributes:
        study: which.
        columns: what is kept by name, for each point in the order of their numbers.
        reasons: why, for each point that failed; "" for the others.
    """

    study: Study
    columns: dict[str, Column]
    reasons: NDArray[np.object_]

    @property
    def failed(self) -> int:
        """Points that were refused or failed."""
        return int(np.count_nonzero(self.reasons != ""))

    def numbers(self) -> dict[str, FloatArray]:
        """Columns of numbers, in the shape of the design; NaN where a point failed."""
        shape = self.study.design.shape
        return {
            name: column.reshape(shape)
            for name, column in self.columns.items()
            if not isinstance(column, Rows)
        }

    def unit(self, name: str) -> str:
        """Of a column, SI; "" without one."""
        return next(one.unit for one in self.study.kept if one.name == name)

    def to_xarray(self) -> xarray.Dataset:
        """One labelled data set.

        Rows of numbers, such as spike times, follow each other in one variable along
        "NAME_sample", with the length of each in "NAME_size" (the contiguous ragged
        arrays of the CF conventions).
        """
        import xarray

        design = self.study.design
        shape, dimensions = design.shape, design.dimensions
        variables: dict[str, Any] = {}
        for name, column in self.columns.items():
            if not isinstance(column, Rows):
                unit = {"units": self.unit(name)}
                variables[name] = (dimensions, column.reshape(shape), unit)
                continue
            unit = {"units": self.unit(name)}
            variables[name] = (f"{name}_sample", column.values, unit)
            about = {"sample_dimension": f"{name}_sample"}
            variables[f"{name}_size"] = (
                dimensions,
                column.sizes.reshape(shape),
                about,
            )
        variables["reason"] = (dimensions, self.reasons.reshape(shape))
        coordinates = {
            name: (dimension, _labels(axis, values), {"units": axis.unit})
            for name, dimension, axis, values in design.coordinates()
        }
        about = {
            "title": self.study.title,
            "study": tomli_w.dumps(_plain(self.study.source)),
            "scene": self.study.scene.to_toml(),
            MADE_OF: study_digest(self.study),
        }
        return xarray.Dataset(variables, coordinates, about)


def gathered(study: Study, shelf: Shelf, places: Places) -> Gathered:
    """All points of a study that has been computed."""
    return Gathered(study, *shelf.gather(places, [one.name for one in study.kept]))


def is_written(study: Study, folder: Path) -> bool:
    """Whether `folder` holds the data set of this very study."""
    try:
        about = json.loads((folder / DATA / ".zattrs").read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return False
    return bool(about.get(MADE_OF) == study_digest(study))


def write(found: Gathered, folder: Path) -> None:
    """Put the data set into `folder`, in place of an earlier one.

    Raises:
        OSError: the folder cannot be written.
    """
    folder.mkdir(parents=True, exist_ok=True)
    part, whole = folder / f"{DATA}.part", folder / DATA
    for old in (part, folder / f"{DATA}.old"):
        shutil.rmtree(old, ignore_errors=True)
    found.to_xarray().to_zarr(part, consolidated=True, zarr_format=2)
    if whole.exists():
        whole.rename(folder / f"{DATA}.old")
    part.rename(whole)
    shutil.rmtree(folder / f"{DATA}.old", ignore_errors=True)


def _labels(axis: Axis, values: list[Any]) -> list[Any]:
    return values if axis.numeric else [axis.shown(value) for value in values]


def _plain(value: Any) -> Any:
    """As TOML has it."""
    if isinstance(value, dict):
        return {key: _plain(one) for key, one in value.items() if one is not None}
    if isinstance(value, tuple | list):
        return [_plain(one) for one in value]
    return value
