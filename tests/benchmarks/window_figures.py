"""What the window costs, as one page.

    python tests/benchmarks/window_figures.py [--out docs/window-figures.md]

Runs `window_start.py`, `window_stop.py`, `window_memory.py`, `window_frames.py`,
`window_record.py` and `window_endurance.py` one after the other, each in a process of
its own; 25 minutes on two cores that do nothing else. Sections of the page that others
made stay at its end.
"""

import argparse
import subprocess
import sys
from pathlib import Path

from provenance import provenance

HERE = Path(__file__).parent
PARTS = (
    ("Start", "window_start.py", ()),
    ("STOP, by parts", "window_stop.py", ()),
    ("Memory of all processes", "window_memory.py", ("50",)),
    ("Frames and gaps", "window_frames.py", ("20",)),
    ("A run of 1e9 samples", "window_record.py", ()),
    ("A simulated hour, and instruments that misbehave", "window_endurance.py", ()),
)
GOALS = """\
A frame is a poll and the painting it causes, every 33 ms, in the window's own thread.
Asked for: median at most 16 ms or idle + 8 ms, p99 at most 33 ms or 1.3 times that of
idle (12 and 22 ms in a run in real time with seven lanes), gaps under 100 ms, at most
35 % of a core in a run, a usable window within 2 s, READY within 2.7 s, STOP to
verified off within 0.3 s on a source that answers in 5 ms, flat memory, and at most
300 MB of all processes together after an hour of runs.
"""


def others(page: str) -> list[str]:
    """Sections of a page that are not made here."""
    parts = ("\n" + page).split("\n## ")[1:]
    own = {title for title, *_ in PARTS}
    return [f"## {one}" for one in parts if one.partition("\n")[0] not in own]


def main() -> None:
    """Run all three and write the page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path)
    options = parser.parse_args()
    page = ["# The window in figures", ""]
    page += [
        f"{provenance()}. Made by `tests/benchmarks/window_figures.py`.",
        "",
        GOALS,
    ]
    for title, script, words in PARTS:
        done = subprocess.run(
            [sys.executable, str(HERE / script), *words],
            stdout=subprocess.PIPE, text=True, check=True,
        )  # fmt: skip
        page += [f"## {title}", "", done.stdout.strip(), ""]
    if options.out and options.out.exists():
        page += others(options.out.read_text(encoding="utf-8"))
    text = "\n".join(page)
    if options.out:
        options.out.write_text(text, encoding="utf-8")
    print(text)


if __name__ == "__main__":
    main()
