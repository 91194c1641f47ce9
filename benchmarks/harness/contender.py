"""A message system under test: how to start its server and its roles."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence
    from pathlib import Path

SCRATCH = "{scratch}"
"""Placeholder for the trial's scratch directory in a server's URL."""


@dataclass(frozen=True, kw_only=True)
class Contender:
    """A message system under test."""

    name: str
    """Such as "callboard" or "zenoh (router)"; unique in a benchmark."""
    version: str
    """Of library and server, for the report."""
    brokered: bool
    """Whether messages pass through a server."""
    role_command: tuple[str, ...]
    """Command that gets the role's parameters as one JSON argument."""
    server_command: Callable[[int, Path], Sequence[str]] | None
    """(free port, scratch directory) -> command line; None if there is no server."""
    server_url: Callable[[int], str]
    """(port) -> the parameter "url" of roles; may be "", may contain `SCRATCH`."""
    roles: frozenset[str]
    """Its roles and their additional abilities; trials that need more are skipped."""
    variables: Mapping[str, str] = field(default_factory=dict[str, str])
    """Environment variables of its roles; values may contain `SCRATCH`."""
