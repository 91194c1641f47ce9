"""Errors of access control.

CallboardError (proto.errors)
├── AccessFileError (ValueError)   the access rules are broken, or cannot be read or changed
└── ProtocolError
    └── Unauthorized               a connection has no user; with the code UNAUTHORIZED
"""

from __future__ import annotations

from proto.errors import CallboardError, ErrorCode, ProtocolError


class AccessFileError(CallboardError, ValueError):
    """The file of access rules is broken, or cannot be read or changed; the text names it and the place."""


class Unauthorized(ProtocolError):  # noqa: N818 - as the error code
    """A connection cannot be attributed to a user.

    Attributes:
        late: Whether to delay the answer, because the address has failed often before.
    """

    def __init__(self, text: str, *, late: bool = False) -> None:
        super().__init__(ErrorCode.UNAUTHORIZED, text)
        self.late = late
