"""Errors of contexts.

CallboardError (proto.errors)
└── ContextError (ValueError)      a context does not exist or is invalid, or the file is broken
    └── UnknownContextError        there is no context of that name
"""

from __future__ import annotations

from proto.errors import CallboardError
from proto.untrusted_text import escape


class ContextError(CallboardError, ValueError):
    """A context does not exist or is invalid, or the file is broken; the text says which and where."""

    is_operational = True


class UnknownContextError(ContextError):
    """There is no context of that name.

    Attributes:
        name: The unknown name.
        known: The names of the existing contexts.
    """

    def __init__(self, name: str, known: tuple[str, ...], source: str = "") -> None:
        super().__init__(f"No context '{escape(name)}'{f' ({source})' if source else ''}")
        self.name = name
        self.known = known
