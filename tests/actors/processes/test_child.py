"""Descriptions of children: which are refused, and what a process's command line is."""

from __future__ import annotations

import math
import sys
from typing import Any

import pytest

import actors


async def work() -> None:
    """Do nothing."""


@pytest.mark.parametrize(
    "wrong",
    [
        {},
        {"node": work, "script": "a.py"},
        {"script": "a.py", "command": ["ls"]},
        {"node": work, "env": {"A": "b"}},
        {"node": work, "cwd": "/"},
        {"node": work, "args": ("a",)},
        {"command": ["ls"], "args": ("a",)},
        {"command": []},
        {"command": "ls -l"},
        {"script": "a.py", "stop_timeout_sec": -1},
        {"script": "a.py", "stop_timeout_sec": math.inf},
        {"script": "a.py", "stop_timeout_sec": math.nan},
    ],
)
def test_options_that_do_not_go_together_are_refused(wrong: dict[str, Any]) -> None:
    """Exactly one way to run, and only the options that go with it."""
    with pytest.raises(ValueError, match="Child 'c'"):
        actors.Child("c", **wrong)


@pytest.mark.parametrize("name", ["", "x" * 256, "two\nlines"])
def test_names_are_checked(name: str) -> None:
    """A name is short and printable."""
    with pytest.raises(ValueError, match="1 to 255 printable"):
        actors.Child(name, node=work)


def test_what_exists_already_is_refused() -> None:
    """A node and a supervisor run once, so that they cannot be started again: their class can."""
    with pytest.raises(TypeError, match="not a Node that exists already"):
        actors.Child("c", node=actors.Node("n"))  # type: ignore[arg-type]
    with pytest.raises(TypeError, match="not a Supervisor that exists already"):
        actors.Child("c", node=actors.Supervisor([]))  # type: ignore[arg-type]
    with pytest.raises(TypeError, match="needs something to call"):
        actors.Child("c", node=5)  # type: ignore[arg-type]


def test_the_command_line_of_a_process() -> None:
    """A script runs under this interpreter, unbuffered; a command as it is."""
    script = actors.Child("c", script="a.py", args=("-v",))
    assert script.argv == [sys.executable, "-u", "a.py", "-v"]
    assert actors.Child("c", command=["ls", "-l"]).argv == ["ls", "-l"]
    assert actors.Child("c", node=work).argv == []


def test_names_are_unique_in_a_supervisor() -> None:
    """Two children of the same name are refused, by name."""
    with pytest.raises(ValueError, match="Two children have the name 'a'"):
        actors.Supervisor([actors.Child(name, node=work) for name in ("a", "b", "a")])
