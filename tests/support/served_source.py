"""A simulated current source behind a port of its own."""

import json
from importlib import resources
from pathlib import Path

from benches import SERVED

from sim_backend.serve import ServedBench
from tactile_lab.engine.request import Request


class Source:
    """A current source at a port of its own: it outlives window and engine."""

    def __init__(self, folder: Path) -> None:
        self.log = folder / "changes.jsonl"
        self.served = ServedBench(coil="pty", log=self.log)
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
        told = self.log.read_text()
        whole = told[: told.rfind("\n") + 1]
        changes = [json.loads(line) for line in whole.splitlines()]
        return bool([d["value"] for d in changes if d["what"] == "output"][-1])
