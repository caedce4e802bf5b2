"""The store beside other ways to put the same samples on the same disk.

    python tests/benchmarks/store_speed.py [--samples 18] [--long 1000] [--out FILE]

Four channels of 8-bit codes with noise of one step. zarr gets a row where it is
installed. `--long` is the length, in millions of samples, of the run that is opened and
zoomed into.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import h5py
import hdf5plugin
import numpy as np
from numpy.typing import NDArray
from provenance import provenance, tell

from tactile_lab.scope import Block, Channel, Stream
from tactile_lab.store.folder import DATA, RunFolder
from tactile_lab.store.layout import Layout
from tactile_lab.store.recorder import Recorder
from tactile_lab.store.run import Run

SIGNALS = ("V_C1", "V_C2", "V_K", "coil_current")
SIZE = 262_144
"""Samples in a block and in a chunk of every format."""

Blocks = list[NDArray[np.int16]]


def blocks(count: int, rows: int = 4) -> Blocks:
    """`count` different blocks of noise on slow curves, codes times 256."""
    rng = np.random.default_rng(3)
    curve = (60 * np.sin(np.arange(SIZE * count) / 3e5)).astype(np.int16)
    made = []
    for number in range(count):
        part = curve[number * SIZE : (number + 1) * SIZE]
        made.append((rng.integers(-1, 2, (rows, SIZE), dtype=np.int16) + part) * 256)
    return [np.ascontiguousarray(block, dtype=np.int16) for block in made]


def ours(path: Path, pool: Blocks, count: int, signals: tuple[str, ...]) -> Path:
    """Checksums, pyramid, SWMR, flush at every chunk: a run as `run` writes it."""
    stream = Stream(
        channels=tuple(Channel(signal=s, input="A", range=5.0) for s in signals),
        interval=1e-6,
        full_scale=32512,
        shift=8,
        started=0.0,
        uncertainty=0.0,
    )
    folder = RunFolder.create(path, "bench", {})
    recorder = Recorder(folder, Layout(signals=signals, simulated=True))
    recorder.segment(stream, 0.0)
    quiet = (False,) * len(signals)
    for number in range(count):
        block = pool[number % len(pool)][: len(signals)]
        recorder.append(Block(number * SIZE, block, quiet, 0.0))
    recorder.close("complete", count * SIZE)
    return folder.path / DATA


def raw(path: Path, pool: Blocks, count: int) -> Path:
    """Append int16 to a file; no checksum, no index, no compression."""
    file = path / "raw.i16"
    with file.open("wb") as out:
        for number in range(count):
            out.write(pool[number % len(pool)].data)
    return file


def hdf5(path: Path, pool: Blocks, count: int, **filters: object) -> Path:
    """Plain HDF5 of int16, not readable while written or after a crash."""
    file = path / "plain.h5"
    with h5py.File(file, "w", libver="latest") as out:
        samples = out.create_dataset(
            "samples", (4, count * SIZE), "i2", chunks=(1, SIZE), **filters
        )
        for number in range(count):
            at = slice(number * SIZE, (number + 1) * SIZE)
            samples[:, at] = pool[number % len(pool)]
    return file


def zarr(path: Path, pool: Blocks, count: int) -> Path:
    """Zarr 3 with its Blosc LZ4 and bit shuffle."""
    import zarr as library
    from zarr.codecs import BloscCodec, BloscShuffle

    folder = path / "run.zarr"
    samples = library.create_array(
        str(folder),
        shape=(4, count * SIZE),
        chunks=(1, SIZE),
        dtype="i2",
        compressors=BloscCodec(cname="lz4", clevel=1, shuffle=BloscShuffle.bitshuffle),
    )
    for number in range(count):
        at = slice(number * SIZE, (number + 1) * SIZE)
        samples[:, at] = pool[number % len(pool)]
    return folder


def measure(write: Callable[[Path], Path], samples: int) -> str:
    """MS/s of wall time, CPU seconds per 1e9 samples, bytes per sample; best of 3."""
    wall = cpu = float("inf")
    size = 0
    for _ in range(3):
        with tempfile.TemporaryDirectory() as folder:
            began, worked = time.perf_counter(), time.process_time()
            made = write(Path(folder))
            wall = min(wall, time.perf_counter() - began)
            cpu = min(cpu, time.process_time() - worked)
            files = made.rglob("*") if made.is_dir() else [made]
            size = sum(file.stat().st_size for file in files if file.is_file())
    ratio = 2 * samples / size
    return f"{samples / wall / 1e6:,.0f} | {cpu / samples * 1e9:.1f} | {ratio:.2f}"


def long_run(millions: int) -> list[str]:
    """Time to open a long run and to look at parts of it."""
    pool = blocks(4, rows=1)
    count = millions * 1_000_000 // SIZE
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        data = ours(Path(folder), pool, count, ("V_K",))
        began = time.perf_counter()
        with Run.load(data.parent) as run:
            signal = run.signal("V_K")
            rows.append(f"| open | {1e3 * (time.perf_counter() - began):.1f} |")
            for part in (1.0, 1.0, 0.1, 0.01, 1e-4, 1e-6):
                middle, half = len(signal) // 2, int(len(signal) * part / 2)
                began = time.perf_counter()
                signal.trace(middle - half, middle + half, cells=2000)
                took = 1e3 * (time.perf_counter() - began)
                rows.append(f"| {part:g} of it in 2000 cells | {took:.1f} |")
    return rows


def main() -> None:
    """Measure and print, or write, the tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--samples", type=int, default=18, help="millions per channel")
    parser.add_argument("--long", type=int, default=1000, help="millions")
    parser.add_argument("--out", type=Path)
    options = parser.parse_args()
    count = max(1, options.samples * 1_000_000 // SIZE)
    samples = 4 * count * SIZE
    pool = blocks(16)
    ways: dict[str, Callable[[Path], Path]] = {
        "this store (int8, bitshuffle-LZ4, CRC-32, pyramid, SWMR, flushed)": (
            lambda path: ours(path, pool, count, SIGNALS)
        ),
        "raw int16 append": lambda path: raw(path, pool, count),
        "HDF5 bitshuffle-LZ4": lambda path: hdf5(
            path, pool, count, **hdf5plugin.Bitshuffle()
        ),
        "HDF5 bitshuffle-zstd": lambda path: hdf5(
            path, pool, count, **hdf5plugin.Bitshuffle(cname="zstd", clevel=1)
        ),
        "HDF5 Blosc2 LZ4": lambda path: hdf5(
            path, pool, count, **hdf5plugin.Blosc2(cname="lz4", clevel=1, filters=2)
        ),
        "HDF5 LZF": lambda path: hdf5(path, pool, count, compression="lzf"),
        "HDF5 gzip-1, shuffle": lambda path: hdf5(
            path, pool, count, compression="gzip", compression_opts=1, shuffle=True
        ),
        "HDF5 uncompressed": lambda path: hdf5(path, pool, count),
    }
    try:
        import zarr as _  # noqa: F401

        ways["zarr 3, Blosc LZ4 bitshuffle"] = lambda path: zarr(path, pool, count)
    except ImportError:
        print("zarr is not installed: no row for it")
    table = [f"| {name} | {measure(way, samples)} |" for name, way in ways.items()]
    text = "\n".join(
        [
            "# Speed of the store",
            "",
            f"{provenance()}, "
            f"h5py {h5py.__version__}. Made by `tests/benchmarks/store_speed.py`: "
            f"{samples / 1e6:.0f} million samples of four channels, blocks of {SIZE} "
            "per channel, best of 3, page cache included. Ratio is against int16.",
            "",
            "| way | MS/s (wall) | CPU s per 1e9 samples | ratio |",
            "|---|---|---|---|",
            *table,
            "",
            f"## Looking into a run of {options.long / 1000:g}e9 samples",
            "",
            "| view | ms |",
            "|---|---|",
            *long_run(options.long),
            "",
        ]
    )
    tell(text, options.out)


if __name__ == "__main__":
    main()
