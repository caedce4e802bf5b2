"""Writes a run until it is killed; says where, then how many samples it handed over.

Not a test: `test_killed_run` starts it. Arguments: root, samples, samples per block.
"""

import runpy
import sys
from pathlib import Path

from tactile_lab.spikes.detector import detector_of
from tactile_lab.store.folder import RunFolder
from tactile_lab.store.layout import Layout
from tactile_lab.store.recorder import Recorder


def main() -> None:
    bench = runpy.run_path(str(Path(__file__).with_name("conftest.py")))
    root, samples, size = Path(sys.argv[1]), int(sys.argv[2]), int(sys.argv[3])
    folder = RunFolder.create(root, "killed", {"protocol": "pulses"})
    print(folder.path, flush=True)
    layout = Layout(
        signals=bench["SIGNALS"], detection=bench["DETECTION"], simulated=True
    )
    recorder = Recorder(folder, layout, reserve=0)
    made = bench["codes"](samples)
    recorder.segment(bench["stream"](), 0.0)
    detector = detector_of(bench["DETECTION"])
    for first in range(0, samples, size):
        one = bench["block"](made, first, size)
        recorder.append(one)
        found = detector.feed(first, one.codes[1])
        recorder.spikes(found["sample"] * 1e-3, found)
        recorder.current(first * 1e-3, 0.1, 0.1)
        print(first + one.samples, flush=True)
    recorder.close("complete", samples)


main()
