"""The window as `tactile-lab gui` opens it, carrying out one scene that it publishes.

    python tests/benchmarks/live_window.py SCENE FOLDER

Driven by `live_lsl.py --window`. Engine and desk are processes of their own, as ever;
the window is painted offscreen, or as QT_QPA_PLATFORM and DISPLAY say. Says
`lsl SOURCE` on stderr once the run is published, and its end as JSON on stdout.
"""

import json
import os
import sys
from pathlib import Path

os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")

from PySide6.QtCore import QTimer

from gui.app import application, begin
from gui.look.theme import Theme
from gui.session.log import LogLine
from gui.session.session import Session
from gui.state import WindowState
from gui.window import Window
from tactile_lab.acquisition.ending import Executed

PUBLISHED = "published live by LSL: "
LOOK = 100
"""Time between two looks at what the window has come to, ms."""


def main(scene: str, folder: str) -> int:
    """Open the window, start its run when it is ready, close it at its end."""
    sys.setswitchinterval(1e-3)
    app = application([])
    theme = Theme("light")
    theme.apply()
    session = Session(Path(folder))
    session.run.reports, session.run.publish = False, True
    window = Window(session, theme)
    window.resize(1720, 1080)
    window.show()
    kept: list[Executed] = []
    started = False

    def read(line: LogLine) -> None:
        if line.text.startswith(PUBLISHED):
            print("lsl", line.text.removeprefix(PUBLISHED), file=sys.stderr, flush=True)

    def look() -> None:
        nonlocal started
        if started:
            if kept or session.state is WindowState.FAULT:
                app.quit()
        elif session.state is WindowState.READY and session.plan.expectation:
            started = True
            window.setup.start()

    session.log.added.connect(read)
    session.run.ended.connect(kept.append)
    timer = QTimer()
    timer.timeout.connect(look)
    QTimer.singleShot(0, lambda: begin(window, scene, "sim"))
    timer.start(LOOK)
    app.exec()
    window.close()
    session.close()
    if not kept:
        print(*(line.text for line in session.log.lines), sep="\n", file=sys.stderr)
        return 1
    (done,) = kept
    told = {
        "duration_s": done.duration, "status": str(done.state), "spikes": done.spikes,
        "loss": done.loss,
    }  # fmt: skip
    print(json.dumps(told))
    return 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
