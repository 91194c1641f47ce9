"""Programs of `programs/` behave the same on callboard's ROS face as on real ROS 2."""

from __future__ import annotations

import ast
from typing import TYPE_CHECKING, Any

import pytest

from tests.real_ros import PROGRAMS
from tests.real_ros.differences import agree

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tests.real_ros.sides import Side

PROGRAM_MODULES = (
    "actions",
    "calls",
    "content_filters",
    "declaring",
    "entities",
    "executing",
    "index",
    "later_names",
    "message_classes",
    "names",
    "nested",
    "private_parts",
    "qos",
    "shutting_down",
    "simulated_time",
    "times",
    "waitables",
)
"""Modules of programs. The functions of the others are for other tests."""


def programs() -> Iterator[str]:
    """Return the functions that take no arguments, by module."""
    for module in PROGRAM_MODULES:
        for node in ast.parse((PROGRAMS / f"{module}.py").read_text(encoding="utf-8")).body:
            if (
                isinstance(node, ast.FunctionDef)
                and not node.name.startswith("_")
                and not ast.unparse(node.args)
            ):
                yield f"{module}.{node.name}"


def with_same_errors(truth: Any, answer: Any) -> Any:
    """Return callboard's answer, with rclpy's errors where a program that catches these catches its own.

    Where rclpy asserts what it gets, the error may be the one that Python has for it.
    """
    if isinstance(truth, dict) and isinstance(answer, dict):
        if "raises" in truth and "raises" in answer:
            name, names = truth["raises"][0], answer["raises"]
            is_same = name in names or (name == "AssertionError" and names[0] in {"TypeError", "ValueError"})
            return truth if is_same else {"raises": names[:1]}
        return {key: with_same_errors(truth.get(key), value) for key, value in answer.items()}
    if isinstance(truth, list) and isinstance(answer, list) and len(truth) == len(answer):
        return [with_same_errors(*pair) for pair in zip(truth, answer, strict=True)]
    return answer


@pytest.mark.parametrize("program", [*programs()])
def test_a_program_gives_the_same_on_both_sides(program: str, real: Side, face: Side) -> None:
    """It returns equal values, or raises the same."""
    truth, answer = real.ask(program).outcome, face.ask(program).outcome
    agree("program", program, real=truth, callboard=with_same_errors(truth, answer))
