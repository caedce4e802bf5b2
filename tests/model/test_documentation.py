"""The example of docs/model.md runs as printed."""

import re
from pathlib import Path

PAGE = Path(__file__).parents[2] / "docs" / "model.md"


def test_the_example_runs(capsys):
    code = re.search(r"```python\n(.*?)```", PAGE.read_text("utf-8"), re.DOTALL)
    exec(code.group(1), {})
    assert "37 spikes, first at 1.0533804" in capsys.readouterr().out
