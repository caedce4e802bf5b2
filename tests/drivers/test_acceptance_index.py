"""Every fact a shipped row calls unverified has its check, and every check exists."""

import re
from pathlib import Path

from tactile_lab.instruments.dialects import dialect_ids, load_dialect

DOCS = Path(__file__).parents[2] / "docs"
HARDWARE = Path(__file__).parents[1] / "hardware"
INDEX = (DOCS / "bench-acceptance.md").read_text(encoding="utf-8")
PAGES = {
    "S": (DOCS / "bench-acceptance-serial.md").read_text(encoding="utf-8"),
    "P": (DOCS / "bench-acceptance-scope.md").read_text(encoding="utf-8"),
}


def test_every_unverified_fact_of_a_row_has_a_check():
    settled = {row[0] for row in re.findall(r"\| (.+?) \| .+? \| (.+?) \|\n", INDEX)}
    for name in dialect_ids():
        assert set(load_dialect(name).unverified) <= settled, name


def test_every_check_of_the_index_exists():
    pico, usbtmc = PAGES["P"].split("## USBTMC")
    pages = {"S": PAGES["S"], "P": pico, "U": usbtmc}
    named = re.findall(r"\b([SPU])(\d+)\b", INDEX)
    assert len(named) > 40
    for page, number in named:
        assert re.search(rf"^\| {number} \|", pages[page], re.MULTILINE), page + number


def test_every_check_has_a_test():
    words = set(re.findall(r"CHECK -k (\w+)", "".join(PAGES.values())))
    tests = " ".join(
        name
        for file in HARDWARE.glob("test_*.py")
        for name in re.findall(r"def (test_\w+)", file.read_text(encoding="utf-8"))
    )
    assert len(words) > 20
    for word in words:
        assert word in tests, word
