"""The names of implementations and their versions in HELLO and WELCOME (docs/protocol.md §4.1.2).

The module is not called "version": PyPI's proto-plus, which claims the name `proto`, too, has one of that
name.
"""

from __future__ import annotations

from typing import Final

VERSION: Final = "0.1.0"
"""The distribution's version, as in pyproject.toml."""


def agent(implementation: str) -> str:
    """Return the `agent` text of an implementation of ours, such as `callboard-python/0.1.0`."""
    return f"{implementation}/{VERSION}"


def version_of(agent_text: str) -> str:
    """Return the version in a peer's `agent` text; empty if there is none."""
    return agent_text.partition("/")[2]
