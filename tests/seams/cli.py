"""What tests read inside argparse and the file of contexts, where no public name has it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from actors.config import contexts

if TYPE_CHECKING:
    from argparse import Action, ArgumentParser


def actions_of(parser: ArgumentParser) -> list[Action]:
    """Return all arguments and options of a parser."""
    return parser._actions


def options_of(parser: ArgumentParser) -> set[str]:
    """Return the option strings that a parser knows."""
    return set(parser._option_string_actions)


def read_back(written: contexts.Contexts) -> tuple[dict[str, contexts.Context], str]:
    """Return the contexts of a text as it would be saved: a property has no time for files."""
    return contexts._read(written._text().encode())
