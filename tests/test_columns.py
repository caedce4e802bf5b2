"""Columns of numbers: a file of nothing else is read at once, others line by line."""

import numpy as np
import pytest

from tactile_lab import columns
from tactile_lab.columns import read_columns
from tactile_lab.errors import SceneError

HEADERS = (("time_s", "force_N"),)
PLAIN = "time_s, force_N\n0,0.1\n 1e-3 ,-2.5e-1\n3,0.30000000000000004\n"


@pytest.fixture
def read(tmp_path):
    def of(text):
        path = tmp_path / "table.csv"
        path.write_text(text)
        return read_columns(path, HEADERS)

    return of


@pytest.mark.parametrize(
    "text",
    [PLAIN.replace("\n", "\n# why\n", 1), PLAIN.replace("\n", "\r\n"), PLAIN + "\n"],
)
def test_it_is_the_same_by_either_way(read, text):
    header, rows, lines = read(text)
    _, plain, _ = read(PLAIN)
    assert header == HEADERS[0]
    assert rows.tobytes() == plain.tobytes()
    assert plain.tolist() == [[0.0, 0.1], [1e-3, -0.25], [3.0, 0.30000000000000004]]
    told = text.splitlines()
    assert [told[line - 1] for line in lines] == PLAIN.splitlines()[1:]


def test_a_file_of_numbers_alone_is_not_read_cell_by_cell(read, monkeypatch):
    """A table of ten million rows took 200 s."""
    monkeypatch.setattr(columns, "read_cells", None)
    assert np.shape(read(PLAIN)[1]) == (3, 2)


@pytest.mark.parametrize("cell", ["nan", "x", "", "1e999", "1,2"])
def test_what_is_wrong_is_named_by_its_line(read, cell):
    with pytest.raises(SceneError, match="line 4"):
        read(PLAIN.replace("3,0.30000000000000004", f"3,{cell}"))
