"""Every verb is where the table says, and its help shows what it can do."""

from __future__ import annotations

import shlex
from pathlib import Path

import pytest

from actors.cli.parsing import parser_of
from actors.cli.table import Verb, each_verb, load
from tests.seams.cli import actions_of, options_of

VERBS = each_verb()
SHAPES = Path(__file__).parents[3] / "docs" / "reference" / "json.md"


@pytest.mark.parametrize(("command", "verb"), VERBS, ids=[command for command, _ in VERBS])
def test_each_example_can_be_typed(command: str, verb: Verb) -> None:
    """A verb has an example; each begins with its name and is read without complaint."""
    module = load(command)
    assert module.EXAMPLES
    for line in module.EXAMPLES:
        words = shlex.split(line.partition(" | ")[0])
        named = ["callboard", *command.split()]
        assert words[: len(named)] == named
        parser_of(command, verb).parse_args(words[len(named) :])


@pytest.mark.parametrize(("command", "verb"), VERBS, ids=[command for command, _ in VERBS])
def test_help_is_short_and_plain(command: str, verb: Verb) -> None:
    """Each argument is explained, and no summary ends like a sentence."""
    parser = parser_of(command, verb)
    assert not verb.summary.endswith(".")
    assert all(action.help for action in actions_of(parser))


def test_each_shape_of_json_is_described() -> None:
    """Every verb with --json has a section in the reference, and no other has."""
    described: list[str] = []
    for line in SHAPES.read_text(encoding="utf-8").splitlines():
        if line.startswith("## "):
            described += line.removeprefix("## ").split(", ")
    having = [command for command, verb in VERBS if "--json" in options_of(parser_of(command, verb))]
    assert sorted(described) == sorted(having)
