"""Identities: of implementations in HELLO and WELCOME (§4.1.2), and of publishers in ATTACHED (§6.3.4).

The module is not called "version": PyPI's proto-plus, which claims the name `proto`, too, has one of that
name.
"""

from __future__ import annotations

from hashlib import blake2b
from typing import Final

from proto import limits

VERSION: Final = "0.1.0"
"""The distribution's version, as in pyproject.toml."""


def agent(implementation: str) -> str:
    """Return the `agent` text of an implementation of ours, such as `callboard-python/0.1.0`."""
    return f"{implementation}/{VERSION}"


def version_of(agent_text: str) -> str:
    """Return the version in a peer's `agent` text; empty if there is none."""
    return agent_text.partition("/")[2]


def public_gid(token: bytes, gid: bytes) -> bytes:
    """Return the id under which others know a publisher: nobody without the token can choose or copy it.

    Args:
        token: The resume token of the publisher's link, which only the client and its brokers know.
        gid: The gid that the link declared the publisher with.
    """
    return blake2b(token + gid, digest_size=limits.INSTANCE_BYTES).digest()
