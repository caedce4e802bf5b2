"""What the model expects of a scene, as lanes and preview need it."""

import numpy as np
import pytest

from gui.session.expectation import expect
from tactile_lab.quantity import parse
from tactile_lab.scene.load import load


@pytest.mark.parametrize("name", ["demo", "staircase", "bipolar"])
def test_a_hold_is_where_the_force_stands_at_the_level_it_is_named_after(
    name: str,
) -> None:
    preview = expect(load(name)).preview
    named = [hold for hold in preview.holds if not hold.pause]
    assert len(named) >= 4
    for hold in named:
        assert hold.held is not None
        assert hold.start <= hold.held[0] < hold.held[1] <= hold.end
        lag = 0.02  # of the field behind the current
        inside = np.linspace(hold.held[0] + lag, hold.held[1], 20)
        level = parse(hold.label, "N")
        assert np.allclose(preview.force.at(inside), level, atol=2e-3)
