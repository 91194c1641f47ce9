"""Every verb, option and argument of ROS 2's command is accepted, or listed with its reason."""

from __future__ import annotations

import re
from argparse import REMAINDER
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import pytest
import yaml

from actors.cli.parsing import parser_of
from actors.cli.reference import DIFFERENCES
from actors.cli.table import each_verb
from tests.seams.cli import actions_of

if TYPE_CHECKING:
    from argparse import Action

ROS2: Final[dict[str, Any]] = yaml.safe_load(
    (Path(__file__).parent / "ros2_verbs.yaml").read_text(encoding="utf-8")
)
VERBS: Final = dict(each_verb())
VALUES: Final[dict[int | str | None, str]] = {0: "", None: "=", 1: "=", "?": "=?", "+": "=...", "*": "=..."}
PLACES: Final[dict[int | str | None, str]] = {None: "1", "?": "?", "+": "...", "*": "...", REMAINDER: "..."}
OPTION: Final = re.compile(r"(?P<names>[-\w ]+)(?P<value>=?[?.]*)(?: \((?P<choices>.*)\))?")


def differences(verb: str) -> set[str]:
    """Return what the parser of a verb refuses or reads in another way, as `DIFFERENCES` has it."""
    actions = actions_of(parser_of(verb, VERBS[verb]))
    arguments = [action for action in actions if not action.option_strings]
    found = {
        f"{verb} {_shown(action)}"
        for action, place in zip(arguments, ROS2[verb]["arguments"].split(), strict=False)
        if PLACES[action.nargs] != place
    }
    by_name = {name: action for action in actions for name in action.option_strings}
    for text in ROS2[verb].get("options", ()):
        option = OPTION.fullmatch(text)
        assert option is not None, text
        names = option["names"].split()
        action = by_name.get(names[0])
        # All its names, of one option: a letter may not mean something else here.
        if action is None or not set(names) <= set(action.option_strings) or not _accepts(action, option):
            found.add(f"{verb} {names[0]}")
    return found


def _accepts(action: Action, option: re.Match[str]) -> bool:
    """Return whether an option takes what ROS 2's does."""
    choices = set(map(str, action.choices or ()))
    wanted = set((option["choices"] or "").split())
    return VALUES[action.nargs] == option["value"] and (not choices or (bool(wanted) and wanted <= choices))


def _shown(action: Action) -> str:
    return str(action.metavar or action.dest).split()[0]


def test_every_verb_is_there() -> None:
    """Words that are no verbs here are in another list."""
    assert set(ROS2) <= set(VERBS)


@pytest.mark.parametrize("verb", ROS2)
def test_options_and_arguments_of_ros_are_accepted(verb: str) -> None:
    """Each name of an option, with a value or without, its choices, and how many arguments there are."""
    listed = {words for words in DIFFERENCES if words.startswith(f"{verb} ")}
    assert differences(verb) == listed
