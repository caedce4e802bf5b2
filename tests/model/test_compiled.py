"""The first use of the solver on a computer says why it takes long."""

import subprocess
import sys

CODE = """
import numba
from tactile_lab.model.compiled import entry
for make in range(2):
    numba.njit(lambda x: x + 1)(1.0)
"""


def test_compiling_is_said_once():
    done = subprocess.run(
        [sys.executable, "-c", CODE], capture_output=True, text=True, check=True
    )
    (line,) = done.stderr.splitlines()
    assert line.startswith("Compiling for this computer, about 20 s")
