"""The error tree: one root, and every leaf is also a builtin exception."""

import inspect
import re
import shlex

import pytest

from tactile_lab import errors
from tactile_lab.errors import RunFolderError
from tactile_lab.store.folder import RunFolder
from tactile_lab.store.run import Run

KINDS = [
    kind
    for _, kind in inspect.getmembers(errors, inspect.isclass)
    if kind.__module__ == errors.__name__
]


@pytest.mark.parametrize("kind", KINDS)
def test_one_root_and_a_builtin_beside_it(kind):
    assert issubclass(kind, errors.TactileLabError)
    if kind is not errors.TactileLabError:
        builtin = [
            base
            for base in kind.__mro__
            if base.__module__ == "builtins"
            and base not in (Exception, BaseException, object)
        ]
        assert builtin


@pytest.mark.parametrize("kind", KINDS)
def test_the_message_is_kept_and_the_tree_is_drawn(kind):
    assert str(kind("V_C1 = 6 V is above 5 V")) == "V_C1 = 6 V is above 5 V"
    assert kind.__name__ in (errors.__doc__ or "")


def test_a_command_that_a_message_tells_can_be_typed_as_it_stands(tmp_path):
    """A folder "my runs" was two words for the shell."""
    run = RunFolder.create(tmp_path / "my runs", "pulses", {})
    run.finish("aborted")
    with pytest.raises(RunFolderError) as told:
        Run.load(run.path)
    command = re.findall(r"`([^`]+)`", str(told.value))[-1]
    assert shlex.split(command) == ["tactile-lab", "run", "--again", str(run.path)]
