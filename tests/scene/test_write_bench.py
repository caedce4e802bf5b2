"""A measured calibration becomes part of a bench file."""

from pathlib import Path

import pytest

from tactile_lab.errors import SceneError
from tactile_lab.scene.load import load, load_bench
from tactile_lab.scene.write_bench import write_calibrated_bench

POINTS = "current_A,field_T\n-1,-0.0095\n0,0\n1,0.0095\n"


def measured(folder: Path, text: str = POINTS) -> Path:
    folder.mkdir(exist_ok=True)
    file = folder / "calibration.csv"
    file.write_text(text)
    return file


def test_bench_takes_its_field_from_the_copy(tmp_path: Path) -> None:
    file = measured(tmp_path / "run1")
    made = write_calibrated_bench(load_bench("sim"), file, tmp_path / "bench.toml")
    file.unlink()
    assert made.simulated and made.coil == load_bench("sim").coil
    scene = load("demo", bench=str(tmp_path / "bench.toml"))
    assert scene.bench.magnet.field(1.0) == pytest.approx(0.0095)


def test_unusable_calibration_leaves_the_bench_as_it_was(tmp_path: Path) -> None:
    path = tmp_path / "bench.toml"
    spec = write_calibrated_bench(load_bench("sim"), measured(tmp_path / "a"), path)
    before = path.read_text()
    with pytest.raises(SceneError, match="0 A"):
        bad = measured(tmp_path / "b", "current_A,field_T\n1,0.01\n2,0.02\n")
        write_calibrated_bench(spec, bad, path)
    assert path.read_text() == before


def test_calibrations_are_never_changed(tmp_path: Path) -> None:
    file, path = measured(tmp_path / "a"), tmp_path / "bench.toml"
    spec = write_calibrated_bench(load_bench("sim"), file, path)
    file.write_text(POINTS.replace("0.0095", "0.0096"))
    with pytest.raises(SceneError, match="never changed"):
        write_calibrated_bench(spec, file, path)
