"""`callboard interface list`, `package` and `packages`: names, without importing a class."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from actors.cli.here import look_here
from actors.cli.output import say, say_json
from actors.cli.tables import Styled, say_styled
from actors.interfaces.catalog import KINDS, interfaces_of, known_packages

if TYPE_CHECKING:
    import argparse

_HEADINGS: Final = {"msg": "Messages:", "srv": "Services:", "action": "Actions:"}


def list_all(options: argparse.Namespace) -> int:
    """Print all types, by kind."""
    names = _of_kinds(options, [name for package in _packages() for name in interfaces_of(package)])
    if options.json:
        say_json(names)
        return 0
    for kind, heading in _HEADINGS.items():
        if kind in _kinds(options):
            say_styled(Styled(heading, "heading"))
            for name in _of_kind(kind, names):
                say(f"    {name}")
    return 0


def package(options: argparse.Namespace) -> int:
    """Print the types of a package."""
    look_here()
    return _say(options, interfaces_of(options.package))


def packages(options: argparse.Namespace) -> int:
    """Print the packages that have types of the kinds asked for."""
    return _say(options, [each for each in _packages() if _of_kinds(options, interfaces_of(each))])


def _packages() -> list[str]:
    look_here()
    return known_packages()


def _kinds(options: argparse.Namespace) -> list[str]:
    """Return the kinds asked for: all if none is."""
    wanted = {"msg": options.only_msgs, "srv": options.only_srvs, "action": options.only_actions}
    return [kind for kind in KINDS if wanted[kind]] or list(KINDS)


def _of_kinds(options: argparse.Namespace, names: list[str]) -> list[str]:
    return [name for kind in _kinds(options) for name in _of_kind(kind, names)]


def _of_kind(kind: str, names: list[str]) -> list[str]:
    return [name for name in names if name.split("/")[1] == kind]


def _say(options: argparse.Namespace, names: list[str]) -> int:
    if options.json:
        say_json(names)
    else:
        for name in names:
            say(name)
    return 0
