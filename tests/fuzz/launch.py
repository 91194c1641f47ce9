"""Launch documents: any YAML, TOML or XML is planned, or refused with a LaunchError."""

from __future__ import annotations

from contextlib import suppress
from typing import TYPE_CHECKING, Final

from actors.launch.description.description import format_actions
from actors.launch.documents.reading import read_document
from actors.launch.errors import LaunchError
from actors.launch.planning.declarations import all_declared
from actors.launch.planning.plan import make_plan
from actors.launch.planning.steps import all_steps
from proto.untrusted_text import escape
from tests.actors.launch.fake_library import FakeLibrary, scope

if TYPE_CHECKING:
    from actors.launch.description.description import LaunchDescription

SUFFIXES: Final = (".yaml", ".xml", ".toml")
FOLDER: Final = "/files"
ENVIRONMENT: Final = {"PATH": "ls:python3", "HOME": "/home/r"}
ARGUMENTS: Final = {"robot": "r2", "n": "3"}


class Library(FakeLibrary):
    """A library in which every launch file is the one under test."""

    def __init__(self, path: str, source: bytes) -> None:
        super().__init__()
        self._path, self._source = path, source

    def description(self, path: str) -> LaunchDescription:
        if path == self._path:
            return read_document(path, self._source)
        return super().description(path)


def check(data: bytes) -> None:
    """Read and plan a file; its first byte selects the kind."""
    path = f"{FOLDER}/f{SUFFIXES[data[0] % len(SUFFIXES) if data else 0]}"
    library = Library(path, data[1:])
    try:
        description = library.description(path)
    except LaunchError as error:
        assert escape(str(error)) == str(error)  # noqa: PT017 - this is no test
        return
    with suppress(LaunchError):
        format_actions(description.actions)
        list(all_declared(description.actions, scope(folder=FOLDER), library))
        for arguments in ({}, ARGUMENTS):
            steps = make_plan(
                description, library, arguments=arguments, environment=ENVIRONMENT, folder=FOLDER
            )
            list(all_steps(steps))
