"""A waveform in pieces is what it is as a whole, and never all there at once."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tactile_lab.long_waveform import LongWaveform
from tactile_lab.waveform import Waveform

STAIRS = Waveform.stairs(
    np.column_stack([np.arange(1, 30) * 0.1, np.sin(np.arange(1, 30))]), 3.5
)


def joined(wave, points=4):
    """Its points, those at which it was cut once."""
    pieces = list(wave.pieces(points))
    assert all(piece.time.size <= points + 1 for piece in pieces)
    for one, after in pairwise(pieces):
        assert (after.start, after.first) == (one.end, one.value[-1])
    ends = [piece.time[1:] for piece in pieces], [piece.value[1:] for piece in pieces]
    return Waveform(
        np.append(pieces[0].start, np.concatenate(ends[0])),
        np.append(pieces[0].first, np.concatenate(ends[1])),
    )


@given(st.integers(1, 80), st.integers(1, 80))
def test_pieces_are_the_whole(of_its_own, points):
    assert joined(STAIRS, points) == STAIRS
    assert joined(LongWaveform(lambda: STAIRS.pieces(of_its_own)), points) == STAIRS


def test_one_point_is_one_piece():
    assert [*Waveform.constant(2.0).pieces(1)] == [Waveform.constant(2.0)]


@pytest.mark.parametrize("by", [-1.25, -1.2, -1e-5, 0.0, 0.3])
def test_it_is_changed_as_the_whole_is(by):
    long = LongWaveform(lambda: STAIRS.pieces(5))
    changed = long.shifted(by).since(0.0).scaled(1.5).each(lambda w: w.shifted(1.0))
    whole = STAIRS.shifted(by).since(0.0).scaled(1.5).shifted(1.0)
    assert Waveform.tidied(*vars(joined(changed)).values()) == whole
    assert joined(changed) == joined(changed), "made anew each time"


def test_pieces_are_made_as_they_are_asked_for():
    made = []

    def make():
        for piece in STAIRS.pieces(5):
            made.append(piece)
            yield piece

    pieces = LongWaveform(make).scaled(2.0).pieces(100)
    assert next(pieces).value[-1] == 2 * made[-1].value[-1]
    assert len(made) == 1
