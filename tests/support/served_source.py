"""A simulated current source behind a port of its own."""

import json
from importlib import resources
from pathlib import Path
from typing import Any

from benches import SERVED

from sim_backend.serve import ServedBench
from tactile_lab.engine.request import Request


class Source:
    """A current source at a port of its own: it outlives window and engine.

    Args:
        folder: for its bench file and its log.
        where: `pty`, or `tcp:0` for any free port.
    """

    def __init__(self, folder: Path, where: str = "pty") -> None:
        self.log = folder / "changes.jsonl"
        self.served = ServedBench(coil=where, log=self.log)
        self.served.start()
        row = resources.files("tactile_lab.instruments").joinpath(
            "rows", "coil", "kepco-bop.toml"
        )
        (folder / "patient.toml").write_text(
            row.read_text().replace("[serial]", '[serial]\ntimeout = "800 ms"')
        )
        self.bench = folder / "bench.toml"
        self.bench.write_text(SERVED.format(port=self.served.addresses["coil"]))
        self.request = Request("demo", ('record.signals=["force"]',), str(self.bench))

    @property
    def output(self) -> bool:
        """Whether the output is on, from what the source was told."""
        return bool([d["value"] for d in self.told() if d["what"] == "output"][-1])

    def told(self) -> list[dict[str, Any]]:
        """Everything it was told so far."""
        text = self.log.read_text() if self.log.exists() else ""
        whole = text[: text.rfind("\n") + 1]
        return [json.loads(line) for line in whole.splitlines()]
