"""What the window costs, as one page.

    python tests/benchmarks/window_figures.py [--out docs/window-figures.md]

Runs `window_frames.py`, `window_record.py` and `window_endurance.py` one after the
other, each in a process of its own; 15 minutes on two cores that do nothing else.
"""

import argparse
import subprocess
import sys
from pathlib import Path

from provenance import provenance

HERE = Path(__file__).parent
PARTS = (
    ("Frames and gaps", "window_frames.py", ("20",)),
    ("A run of 1e9 samples", "window_record.py", ()),
    ("A simulated hour, and instruments that misbehave", "window_endurance.py", ()),
)
GOALS = """\
A frame is a poll and the painting it causes, every 33 ms, in the window's own thread.
Asked for: median at most 16 ms or idle + 8 ms, p99 at most 33 ms or 1.3 times that of
idle, gaps under 100 ms, a usable window within 2 s, flat memory.
"""


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
    text = "\n".join(page)
    if options.out:
        options.out.write_text(text, encoding="utf-8")
    print(text)


if __name__ == "__main__":
    main()
