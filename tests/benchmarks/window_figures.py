"""What the window costs, as one page.

    python tests/benchmarks/window_figures.py --out docs/window-figures.md
        [--short] [--beside CHECKOUT] [--parts WORD ...]

Runs its neighbours one after the other, each in a process of its own, and writes the
page after each: a section that names the commit at hand is not made again, so that what
was cut short is taken up where it was. `--short` takes a third of the time with fewer
starts, runs and samples; the sections tell how many. `--beside` names another checkout
whose start and whose lanes on scaled screens are measured in turn with these. `--parts`
makes only sections whose title has one of the words. Other sections of the page stay.
"""

import argparse
import subprocess
import sys
import time
from pathlib import Path

from provenance import provenance

HERE = Path(__file__).parent
TITLE = "# The window in figures"
START, SCALED = "Start", "Scaled screens"
PARTS = (
    (START, "window_start.py", ("6",), ("3",)),
    ("Frames and gaps", "window_frames.py", ("20",), ("6",)),
    *(
        (f"Frames and gaps at scale {scale}", "window_frames.py",
         ("20", "--scale", scale), ("6", "--scale", scale))
        for scale in ("1.5", "2")
    ),
    ("Memory of all processes", "window_memory.py", ("50",), ("16",)),
    ("STOP, by parts", "window_stop.py", (), ()),
    (SCALED, "window_scales.py", ("--rounds", "3"), ("--rounds", "1")),
    ("A run of 1e9 samples", "window_record.py", ("1000",), ("100",)),
    ("A long session through X", "window_session.py", ("2311",), ("2311", "60")),
    (
        "A simulated hour, and instruments that misbehave", "window_endurance.py",
        ("3600",), ("900",),
    ),
)  # fmt: skip
GOALS = """\
A frame is a poll and the painting it causes, in the window's own thread: every 33 ms,
and less often, at least ten times a second, where that thread would take more than 30 %
of a core ([why](decisions/frames-within-a-budget.md)). A frame that leaves its lanes to
the next counts as one; numbers, shown halfway between two, have a row.

Asked for: median at most 16 ms or idle + 8 ms, p99 at most 33 ms or 1.3 times that of
idle (12 and 22 ms in a run in real time with seven lanes), gaps under 100 ms, at most
35 % of a core in a run, a usable window within 2 s, READY within 2.7 s, STOP to
verified off within 0.3 s on a source that answers in 5 ms ([beside other
programs](decisions/stop-on-a-busy-computer.md) later), flat memory, and at most 300 MB
of all processes together after an hour of runs.

Times are of the hour they were taken in: the same code on the same quiet cores has
taken 1.5 times as long 40 minutes earlier.
"""


def sections(page: str) -> dict[str, str]:
    """The text of each section of a page, by its title."""
    parts = (one.partition("\n") for one in ("\n" + page).split("\n## ")[1:])
    return {title: text.strip() for title, _, text in parts}


def beside(title: str, checkout: Path | None) -> list[str]:
    """Words that have another checkout measured in turn, where a section can."""
    if checkout is None:
        return []
    other = {START: checkout, SCALED: checkout / ".venv" / "bin" / "python"}
    return ["--beside", str(other[title])] if title in other else []


def main() -> None:
    """Make what is missing, section by section."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--short", action="store_true")
    parser.add_argument("--beside", type=Path)
    parser.add_argument("--parts", nargs="+", default=[""])
    options = parser.parse_args()
    here = provenance()
    commit = here.partition(",")[0]
    kept = {}
    if options.out.exists():
        kept = sections(options.out.read_text(encoding="utf-8"))
    for title, script, whole, short in PARTS:
        wanted = any(word.lower() in title.lower() for word in options.parts)
        if not wanted or f"{commit}," in kept.get(title, ""):
            continue
        words = short if options.short else whole
        others = beside(title, options.beside)
        begun = time.monotonic()
        done = subprocess.run(
            [sys.executable, str(HERE / script), *words, *others],
            stdout=subprocess.PIPE, text=True, check=True,
        )  # fmt: skip
        took = f"{(time.monotonic() - begun) / 60:.1f} min"
        command = f"`python tests/benchmarks/{' '.join([script, *words])}`"
        kept[title] = f"{here}. Made by {command} in {took}.\n\n{done.stdout.strip()}"
        made = [f"## {title}\n\n{text}\n" for title, text in kept.items()]
        options.out.write_text("\n".join([TITLE, "", GOALS, *made]), encoding="utf-8")
        print(f"{title}: {took}", flush=True)


if __name__ == "__main__":
    main()
