"""What the harness knows of a message system: how to start its server and its roles."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from pathlib import Path

SCRATCH = "{scratch}"
"""Stands in a server's URL for the trial's scratch directory."""


@dataclass(frozen=True, kw_only=True)
class Contender:
    """A message system under test."""

    name: str
    """Such as "callboard" or "zenoh (router)"; unique in a run."""
    version: str
    """Of library and server, for the report."""
    brokered: bool
    """Whether messages pass through a server."""
    role_command: tuple[str, ...]
    """What stands before the role's parameters, which are one JSON argument."""
    server_command: Callable[[int, Path], Sequence[str]] | None
    """(free port, scratch directory) -> command line; None if there is no server."""
    server_url: Callable[[int], str]
    """(port) -> what roles get as "url"; may be "", may contain `SCRATCH`."""
    roles: frozenset[str]
    """The roles it has, and what they understand beyond what all do; trials that need more are skipped."""
    socket_name: str | None = None
    """The server listens on this unix socket in the scratch directory instead of on the port."""
