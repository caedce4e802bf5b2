"""The page docs/how-to/add-a-dialect.md, block by block."""

import re
import tomllib
from pathlib import Path

from tactile_lab.instruments.dialects import coil_dialect
from tactile_lab.instruments.serial_dialect import AnalogueMode, ListMode
from tactile_lab.scene.bench_file import GeneratorWiring
from tactile_lab.table import dumped

PAGE = Path(__file__).parents[2] / "docs" / "how-to" / "add-a-dialect.md"
BLOCK = re.compile(r"^```(\w+)\n(.*?)^```$", re.MULTILINE | re.DOTALL)


def test_the_page_works(tmp_path, monkeypatch):
    blocks = BLOCK.findall(PAGE.read_text(encoding="utf-8"))
    kinds = [kind for kind, _ in blocks]
    meters = ["toml", "text", "python", "toml", "python"]
    source = ["toml", "python", "toml", "toml", "toml", "python"]
    assert kinds == [*meters, *source]
    monkeypatch.chdir(tmp_path)
    name = ""
    for kind, text in blocks:
        if kind == "toml" and text.startswith("[list]"):
            shown = ListMode.model_validate(tomllib.loads(text)["list"])
            assert shown == coil_dialect("kepco-bop").list
        elif kind == "toml" and text.startswith("[analogue]"):
            mode = AnalogueMode.model_validate(tomllib.loads(text)["analogue"])
            assert mode == coil_dialect("kepco-bop").analogue
        elif kind == "toml" and text.startswith("[coil.generator]"):
            wiring = GeneratorWiring(gain=0.485)
            assert tomllib.loads(text)["coil"]["generator"] == dumped(wiring)
        elif kind == "toml":
            name = tomllib.loads(text)["id"]
            Path(f"{name}.toml").write_text(text, encoding="utf-8")
        elif kind == "text":
            Path(f"{name}.txt").write_text(text, encoding="utf-8")
        else:
            exec(compile(text, str(PAGE), "exec"), {})
