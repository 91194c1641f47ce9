"""Programs of `programs/` behave the same on callboard's ROS face as on real ROS 2."""

from __future__ import annotations

import ast
from typing import TYPE_CHECKING

import pytest

from tests.real_ros import PROGRAMS
from tests.real_ros.differences import agree

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tests.real_ros.sides import Side

NOT_PROGRAMS = ("definitions", "environment", "message_types", "packages", "parameters")
"""Modules whose functions are for other tests."""


def programs() -> Iterator[str]:
    """Return the functions that take no arguments, by module."""
    for path in sorted(PROGRAMS.glob("[a-z]*.py")):
        functions = ast.parse(path.read_text(encoding="utf-8")).body if path.stem not in NOT_PROGRAMS else []
        for node in functions:
            if (
                isinstance(node, ast.FunctionDef)
                and not node.name.startswith("_")
                and not ast.unparse(node.args)
            ):
                yield f"{path.stem}.{node.name}"


@pytest.mark.parametrize("program", [*programs()])
def test_a_program_gives_the_same_on_both_sides(program: str, real: Side, face: Side) -> None:
    """It returns equal values, or raises an exception of the same name.

    Where rclpy asserts what it gets, callboard has the errors that Python has for it.
    """
    truth, answer = real.ask(program), face.ask(program)
    if truth.raised == "AssertionError" and answer.raised in {"TypeError", "ValueError"}:
        truth = answer
    agree("program", program, real=truth.outcome, callboard=answer.outcome)
