"""docs/reference/waits.md has every public wait with its limit."""

from __future__ import annotations

import inspect
import re
from pathlib import Path
from typing import Any, Final

import pytest

import actors
import actors.testing
import actors.threads

DOCUMENT: Final = Path(__file__).parents[1] / "docs/reference/waits.md"
ROW: Final = re.compile(r"^\| (`.*`) \| ([^|]+) \| ([^|]+) \|$", re.MULTILINE)
OPTIONS: Final = {"SimulatedClock", "Inspector", "launch"}
"""Their `timeout_sec` is an option for later waits and answers, not a wait."""

DOCUMENTED: Final = {
    name: (omitted.strip(), end.strip())
    for names, omitted, end in ROW.findall(DOCUMENT.read_text())
    for name in re.findall(r"`(.*?)`", names)
}


def _waits() -> dict[str, Any]:
    """Return the public functions and methods that have a time limit."""
    members: dict[str, Any] = {}
    for package in (actors, actors.threads, actors.testing):
        for name in set(dir(package)) - OPTIONS:
            value = getattr(package, name)
            if inspect.isclass(value):
                members |= {
                    f"{name}.{key}": each for base in value.__mro__ for key, each in vars(base).items()
                }
            else:
                members[name] = value
    return {
        name: each
        for name, each in sorted(members.items())
        if inspect.isfunction(each)
        and not name.rpartition(".")[2].startswith("_")
        and not name.startswith("Lifecycle")  # as for Node and Publisher
        and "timeout_sec" in inspect.signature(each).parameters
    }


WAITS: Final = _waits()


def test_the_table_has_every_wait() -> None:
    """And no other."""
    assert sorted(DOCUMENTED) == sorted(WAITS)


@pytest.mark.parametrize("name", WAITS)
def test_the_table_says_how_a_wait_ends(name: str) -> None:
    """The limit is the default in the code, and the docstring names the error."""
    omitted, end = DOCUMENTED[name]
    function = WAITS[name]
    default = inspect.signature(function).parameters["timeout_sec"].default
    of_document = {
        "the node's deadline": actors.DEFAULT_TIMEOUT,
        "the launch's `timeout_sec`": actors.DEFAULT_TIMEOUT,
        "no limit": None,
    }
    assert default == (float(omitted.removesuffix(" s")) if omitted[0].isdigit() else of_document[omitted])
    returns_bool = function.__annotations__["return"] == "bool"
    if end == "False":
        assert returns_bool
        assert "False if" in function.__doc__
    elif end != "`ServiceTimeout`":  # for most of these, Client.call says so
        assert end.split("`")[1] in function.__doc__
