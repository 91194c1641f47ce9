"""Parameter files and `-p` rules give a node the same parameters as in ROS 2, or stop it alike."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest
from hypothesis import given

from tests.real_ros.differences import agree
from tests.real_ros.parameter_texts import DOUBLES, INTEGERS, VALUES, WORDS, files

if TYPE_CHECKING:
    from tests.real_ros.sides import Side

ALL = "/**: {ros__parameters: {a: 0}}\n"
NODE = "n: {ros__parameters: {a: 1}}\n"
FILES = (
    "",
    "# nothing",
    "---",
    "/**:",
    "/**:\n  ros__parameters:",
    "/**:\n  ros__parameters:\n    a: []",
    "/**:\n  ros__parameters:\n    a: {}",
    "/**:\n  ros__parameters:\n    a: 1\n    a: 2",
    "/**:\n  ros__parameters:\n    a: [1.5]\n    a: ['b']",
    "/**:\n  ros__parameters:\n    a: 1\n    a: x",
    "/**:\n  ros__parameters:\n    a: x\n    a: 1",
    "n: {ros__parameters: {a: true}}\n---\nn: {ros__parameters: {a: 2}}",
    "/**:\n  ros__parameters: {a.b: 1, a: {c: 2}}",
    "/**:\n  ros__parameters: {a: 1, <<: 2}",
    "/**:\n  ros__parameters: []",
    "/**:\n  ros__parameters:\n    - a: 1",
    "/**:\n  ros__parameters:\n    a:\n    - b: 1",
    "- /**:\n    ros__parameters: {a: 1}",
    "/**:\n  ros__parameters: {a.b: {c.d: {x: 1}, y: 2}}",
    "/**:\n  ros__parameters: {a: 1, a: x}",
    "/**:\n  ros__parameters: {a: &x 1, b: *x}",
    "/**:\n  ros__parameters:\n    a: |\n      two\n      lines\n    b: >\n      two\n      lines",
    "/**:\n  ros__parameters:\n    a: |-\n      1\n",
    "/**: {ros__parameters: {a: 1}}\nn: {ros__parameters: {a: 2}}",
    "n: {ros__parameters: {a: 2}}\n/**: {ros__parameters: {a: 1}}",
    "n: {ros__parameters: {a: 1}}\n/n: {ros__parameters: {b: 2}}",
    "n: {ros__parameters: {a: 1}}\n---\nn: {ros__parameters: {a: 2}}",
    "%YAML 1.2\n---\nn: {ros__parameters: {a: 1}}",
    "n:\n\tros__parameters: {a: 1}",
    "[1, 2]",
    "text",
)
SOURCES = {
    "two rules": (("rule", "a:=1"), ("rule", "a:=2")),
    "a file of the node, and a rule": (("file", NODE), ("rule", "a:=2")),
    "a rule, and a file of the node": (("rule", "a:=2"), ("file", NODE)),
    "a file of all nodes, and a rule": (("file", ALL), ("rule", "a:=2")),
    "a file of all nodes and the node, and a rule": (("file", f"{ALL}{NODE}"), ("rule", "a:=2")),
    "a file of the node and all nodes, and a rule": (("file", f"{NODE}{ALL}"), ("rule", "a:=2")),
    "a rule for the node": (("rule", "n:a:=2"), ("rule", "other:a:=3")),
}
RULES = ("[]", "[a:b, c]", "a:b", "[1, [2]]", "{a: 1}", "[1, 2", "- 1", "1, 2", " 1 ", "")


def compare(case: str, function: str, argument: object, real: Side, face: Side) -> None:
    """Compare the names, values and types of a node's parameters, or that both sides refuse them."""
    answers = [side.ask(f"written_parameters.{function}", argument) for side in (real, face)]
    truth, answer = ("refused" if each.raised else each.returned for each in answers)
    agree("parameter", case, real=truth, callboard=answer)


@pytest.mark.parametrize("text", FILES)
def test_a_file_is_read_alike(text: str, real: Side, face: Side) -> None:
    """Files that are nearly empty, have aliases, blocks, repeated or dotted names, or several documents."""
    compare(text, "of_file", text, real, face)


@pytest.mark.parametrize("text", [*RULES, *WORDS, *INTEGERS, *DOUBLES])
def test_a_rule_is_read_alike(text: str, real: Side, face: Side) -> None:
    """Words and numbers for which YAML 1.1, YAML 1.2 and rcl have rules, or which look like others."""
    compare(text, "of_rules", [text], real, face)


@given(text=VALUES)
def test_values_in_rules_are_read_alike(text: str, real: Side, face: Side) -> None:
    """So are numbers made of odd characters, and lists."""
    compare(text, "of_rules", [text], real, face)


@given(text=VALUES)
def test_values_in_files_are_read_alike(text: str, real: Side, face: Side) -> None:
    """And both of them in files."""
    compare(text, "of_file", f"n:\n  ros__parameters:\n    a: {text}\n    b: 1\n", real, face)


@given(text=files())
def test_whole_files_are_read_alike(text: str, real: Side, face: Side) -> None:
    """Nodes, namespaces and names of all kinds."""
    compare(text, "of_file", text, real, face)


@pytest.mark.parametrize("case", SOURCES)
def test_the_order_of_sources(case: str, real: Side, face: Side) -> None:
    """Which of several values counts."""
    compare(case, "of_sources", SOURCES[case], real, face)
