"""Nothing in tactile_lab names a module above it, not even in a text."""

import ast
import re
from pathlib import Path

import pytest

from tactile_lab.plugins import plugged_in, registered

ROOT = Path(__file__).parents[1]
UPWARD = re.compile(r"(drivers|sim_backend|gui|protocols)(\.\w+)*")
GROUPS = ("drivers", "far_ends", "benches", "protocols", "verbs")


def texts(path):
    """Texts that the code of a file holds, docstrings left out."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    said = {
        id(node.value)
        for node in ast.walk(tree)
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant)
    }
    for node in ast.walk(tree):
        if isinstance(node, ast.Constant) and isinstance(node.value, str):
            if id(node) not in said:
                yield node.value


@pytest.mark.parametrize(
    "path", sorted((ROOT / "tactile_lab").rglob("*.py")), ids=lambda path: path.name
)
def test_no_text_is_the_name_of_a_module_above(path):
    assert [text for text in texts(path) if UPWARD.fullmatch(text)] in (
        [],
        ["gui"],
    )  # a verb


@pytest.mark.parametrize("group", GROUPS)
def test_whatever_is_registered_is_there(group):
    names = registered(f"tactile_lab.{group}")
    assert names, "install the checkout again: pip install -e ."
    for name in names:
        assert plugged_in(f"tactile_lab.{group}", name) is not None
