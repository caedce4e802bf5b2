"""The window as the program starts it."""

import json
import os
import subprocess
import sys

from benches import SERVED

ROW = "kepco-bop"

STARTED = """
import gc, json, linecache, sys
from pathlib import Path

told = {}

def watched(window, *rest):
    session = window.session
    told["reads runs"] = [m for m in ("h5py", "scipy", "numba") if m in sys.modules]
    told["asked before it is shown"] = session.state is WindowState.CONNECTING
    begin(window, *rest)
    timer = QTimer(window)

    def look():
        ready = session.state is WindowState.READY and session.plan.expectation
        if ready and "gui.lanes.stored" in sys.modules:
            timer.stop()
            told["loaded ahead"] = "numpy.ma" in sys.modules
            told["collects in any thread"] = gc.isenabled()
            told["log"] = [line.text for line in window.centre.log.model.lines]
            told["sources read"] = [f for f in linecache.cache if "numpy" in f]
            window.close()

    timer.timeout.connect(look)
    timer.start(5)

if __name__ == "__main__":  # the engine loads this file, too
    from PySide6.QtCore import QTimer
    import gui.app as app
    from gui.state import WindowState

    begin, app.begin = app.begin, watched
    told["code"] = app.main("demo", out=Path(sys.argv[1]), bench="sim")
    print(json.dumps(told))
"""


def test_the_bench_is_asked_while_the_window_is_built(tmp_path):
    """And no module's source is kept in memory, as PySide6 does where it is let."""
    script = tmp_path / "started.py"
    script.write_text(STARTED)
    alone = {"QT_QPA_PLATFORM": "offscreen", "XDG_CONFIG_HOME": str(tmp_path)}
    done = subprocess.run(
        [sys.executable, script, tmp_path / "runs"],
        env=os.environ | alone, capture_output=True, text=True, timeout=240,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    told = json.loads(done.stdout.splitlines()[-1])
    assert told["asked before it is shown"]
    assert told["reads runs"] == [], "loaded once the bench is ready"
    assert not told["collects in any thread"]
    assert told["loaded ahead"], "numpy would load it in a frame, at a step's end"
    assert told["log"][0].startswith("Asking the instruments of")
    assert told["sources read"] == [] and told["code"] == 0


IN_DOUBT = """
import sys
from pathlib import Path

def watched(window, *rest):
    session, timer = window.session, QTimer(window)
    begin(window, *rest)

    def look():
        if session.state is WindowState.FAULT:
            timer.stop()
            print(window.header.stop.words.title)
            window.close()

    timer.timeout.connect(look)
    timer.start(5)

if __name__ == "__main__":  # the engine loads this file, too
    from PySide6.QtCore import QTimer
    import gui.app as app
    from gui.state import WindowState

    begin, app.begin = app.begin, watched
    sys.exit(app.main("demo", out=Path(sys.argv[1]), bench=sys.argv[2]))
"""


def test_the_exit_code_tells_of_a_coil_that_is_in_doubt(tmp_path):
    """It was 0 where a source had not answered, which STOP called unknown."""
    script, bench = tmp_path / "in_doubt.py", tmp_path / "bench.toml"
    script.write_text(IN_DOUBT)
    bench.write_text(SERVED.format(port=tmp_path / "gone").replace("patient.toml", ROW))
    alone = {"QT_QPA_PLATFORM": "offscreen", "XDG_CONFIG_HOME": str(tmp_path)}
    done = subprocess.run(
        [sys.executable, script, tmp_path / "runs", bench],
        env=os.environ | alone, capture_output=True, text=True, timeout=240,
    )  # fmt: skip
    assert done.stdout == "COIL STATE UNKNOWN\n", done.stderr
    assert done.returncode == 4


LEFT = """
import sys, threading, time
from pathlib import Path
from types import SimpleNamespace

import h5py
from PySide6.QtCore import QCoreApplication, QObject

from gui.lanes import stored
from gui.screen.records import Records

reading, kept = threading.Event(), h5py.h5p.create(h5py.h5p.FILE_ACCESS)

def read(folder):
    with h5py._objects.phil:
        reading.set()
        time.sleep(0.5)
        print("read")
    raise OSError("nothing is there")

stored.RunSource = read
app, parent = QCoreApplication([]), QObject()
records = Records(SimpleNamespace(), parent)
records.open(Path("a run"))
reading.wait()
"""


def test_a_program_that_is_left_while_a_run_is_read_ends():
    """Cut off within HDF5, the reading thread kept its lock, and the end waited."""
    done = subprocess.run(
        [sys.executable, "-c", LEFT], capture_output=True, text=True, timeout=120
    )
    assert (done.returncode, done.stdout, done.stderr) == (0, "read\n", "")
