"""What the two ends call themselves: implementation and version, for people (docs/protocol.md §4.1.2).

The module is not called "version": PyPI's proto-plus, which claims the name `proto`, too, has one of that
name.
"""

from __future__ import annotations

from typing import Final

VERSION: Final = "0.1.0"
"""The distribution's: what pyproject.toml says."""


def agent(implementation: str) -> str:
    """Return what an implementation of ours calls itself in HELLO or WELCOME."""
    return f"{implementation}/{VERSION}"


def version_of(agent_text: str) -> str:
    """Return the version in what a peer calls itself; empty if it names none."""
    return agent_text.partition("/")[2]
