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
        level = parse(hold.label, "N")
        # nothing comes near to 0 N by parts: as asked, and the coil comes later
        late = 0.02 if level else 0.1
        inside = np.linspace(hold.held[0] + late, hold.held[1], 20)
        assert np.allclose(preview.force.at(inside), level, atol=2e-3)
