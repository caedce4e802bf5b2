"""What the progress line of a run tells of its spikes."""

import pytest

from tactile_lab.commands.one_run import Narrator
from tactile_lab.engine.execution import Execution
from tactile_lab.scene.load import load

SHORT = ('protocol.levels=["200 mN"]', 'protocol.hold="300 ms"')


@pytest.mark.parametrize(
    ("rate", "told"), [("200 kS/s", " spikes seen, not all"), ("500 kS/s", "last at ")]
)
def test_a_rate_is_told_only_of_spikes_that_are_all_seen(
    rate, told, tmp_path, capsys
) -> None:
    """The report refuses the rate of spikes that fall between two samples."""
    scene = load("demo", (*SHORT, f'record.sample_rate="{rate}"'), bench="sim")
    narrator = Narrator("demo")
    execution = Execution(scene, tmp_path, emit=narrator)
    narrator.expect(execution)
    execution.run()
    narrator.close()
    said = capsys.readouterr().err
    assert told in said
    assert (" Hz" in said) is ("last" in told)
