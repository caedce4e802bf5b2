"""Bench files are written: none that cannot be read again takes another's place."""

from __future__ import annotations

from pathlib import Path

import tomli_w

from tactile_lab.errors import SceneError
from tactile_lab.scene.bench_file import BenchSpec
from tactile_lab.scene.load import load_bench
from tactile_lab.table import dumped
from tactile_lab.whole_file import failing_as, replacing


def write_bench(text: str, path: Path) -> BenchSpec:
    """Write a bench file, ending in .toml, and read it back.

    Raises:
        SceneError: `text` is no usable bench; what was at `path` stays.
        OSError: `path` cannot be written.
    """
    with replacing(path) as draft:
        draft.write_bytes(text.encode())
        load_bench(draft)
    return load_bench(path)


def write_calibrated_bench(spec: BenchSpec, calibration: Path, path: Path) -> BenchSpec:
    """Write `spec` as the bench file `path`, with a copy of `calibration` beside it.

    The copy keeps the bench usable when the run that measured it is cleared away. A
    calibration is never changed: a copy of that name with other contents is refused.

    Args:
        spec: the bench as it is used now.
        calibration: as `analysis.field_calibration.write_calibration` made it.
        path: ends in .toml; a bench file there is replaced.

    Raises:
        SceneError: the calibration or the bench cannot be used or written; the bench
            file that was there stays.
    """
    copy = path.with_name(f"{path.stem}-{calibration.parent.name}.csv")
    table = dumped(spec)
    table.pop("file", None)
    table["magnet"]["calibration"] = copy.name
    with failing_as(f"Bench file {path} cannot be written", kind=SceneError):
        contents = calibration.read_bytes()
        if copy.exists() and copy.read_bytes() != contents:
            raise SceneError(
                f"Calibration {copy} exists with other contents; calibrations are "
                "never changed. Choose another name for the bench file."
            )
        if not copy.exists():
            with replacing(copy) as part:
                part.write_bytes(contents)
                part.chmod(0o444)
        return write_bench(tomli_w.dumps(table), path)
