"""The first use of the solver on a computer says why it takes long."""

import os
import pickle
import subprocess
import sys

import numba
import pytest

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
    assert line.startswith("Compiling for this computer, 20 s to a minute")


KEPT = """
import os, sys
from pathlib import Path
from numba.core import caching
import tactile_lab.model.compiled
from tactile_lab.code_cache import kept

def twice(x):
    return 2 * x

for line in sys.stdin:  # each in a process that has loaded the compiler, no more
    child = os.fork()
    if not child:
        if "unwritable" in line:
            caching.CacheImpl._locator_classes = []
        print(kept(twice)(3.0), flush=True)
        os._exit(0)
    print("ended with", os.waitpid(child, 0)[1], flush=True)
"""


@pytest.mark.skipif(os.name != "posix", reason="forks")
def test_a_cache_that_cannot_be_used_costs_only_time(tmp_path, monkeypatch):
    """An empty file of it made every verb end with 130, as EOFError means Ctrl-C.

    One that names a class of an earlier version ended each in an AttributeError.
    """
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "cache"))
    (tmp_path / "own.py").write_text(KEPT)

    def run(how=""):
        program.stdin.write(f"{how}\n")
        program.stdin.flush()
        said = ""
        while "ended with" not in said:
            line = program.stdout.readline()
            assert line, said
            said += line
        assert said.endswith("6.0\nended with 0\n"), said
        return said.removesuffix("6.0\nended with 0\n")

    renamed = pickle.dumps(numba.__version__) + b"ctactile_lab.quantity\nRenamed\n."
    with subprocess.Popen(
        [sys.executable, tmp_path / "own.py"], text=True,
        stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
    ) as program:  # fmt: skip
        first = run("unwritable")
        assert "Compiling" in first and "cannot be kept" in first
        assert "Compiling" in run(), "nothing was kept"
        for spoilt, content in (("nbi", b""), ("nbi", renamed), ("nbc", b"")):
            files = list(tmp_path.glob(f"cache/**/*.{spoilt}"))
            assert files
            for file in files:
                file.write_bytes(content)
            again = run()
            assert "Compiling" in again and "cannot be kept" not in again
            assert not run(), f"a spoilt {spoilt} was not mended"
        program.stdin.close()


APART = """
import os, sys
from numba.core import caching
import tactile_lab.model.compiled
from tactile_lab.code_cache import compiled_apart, kept

here = os.getpid()
if "unwritable" in sys.argv:
    caching.CacheImpl._locator_classes = []
twice = kept(lambda x: 2 * x)
real = twice._compiler.compile

def compile(*arguments):
    print("here" if os.getpid() == here else "apart", flush=True)
    return real(*arguments)

twice._compiler.compile = compile
compiled_apart(lambda: print(twice(3.0), flush=True))
"""


@pytest.mark.skipif(os.name != "posix", reason="forks")
def test_what_stays_for_days_has_a_child_compile(tmp_path, monkeypatch):
    """All engines of a first day held the compiler, 130 MB in each."""
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "cache"))
    (tmp_path / "own.py").write_text(APART)

    def done(*how):
        return subprocess.run(
            [sys.executable, tmp_path / "own.py", *how],
            capture_output=True, text=True, check=True,
        )  # fmt: skip

    assert done("unwritable").stdout == "here\n6.0\n", "nobody could keep it"
    first = done()
    assert first.stdout == "apart\n6.0\n6.0\n"
    assert first.stderr.startswith("Compiling") and first.stderr.count("\n") == 1
    assert done().stdout == "6.0\n"


ALONE = """
import sys
from tactile_lab import simulate
assert simulate("demo").spike_times.size
print("numba.np.arraymath" in sys.modules, "scipy.linalg" in sys.modules)
"""


def test_code_from_the_disk_runs_without_the_compiler():
    """It took 0.3 s and 20 MB of each process that ran what was compiled before."""
    for _ in range(2):  # the first one may find the disk empty
        done = subprocess.run(
            [sys.executable, "-c", ALONE], capture_output=True, text=True, check=True
        )
        if done.stdout == "False False\n":
            break
    assert done.stdout == "False False\n"
