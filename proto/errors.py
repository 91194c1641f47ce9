"""The exceptions of all packages.

    CallboardError                      base of every error callboard raises
    ├── InvalidNameError (ValueError)   a name breaks a naming rule
    │   ├── InvalidNodeNameError
    │   ├── InvalidNamespaceError
    │   ├── InvalidTopicNameError
    │   └── InvalidServiceNameError
    ├── InvalidUrlError (ValueError)    a broker URL is invalid
    ├── TlsFileError (ValueError)       a file with a certificate, key or authority cannot be used
    └── ProtocolError                   the peer violated the protocol

`ErrorCode` lists the codes of ERROR and REFUSED frames (docs/protocol.md §9). The packages `broker` and
`actors` add their own errors below `CallboardError` in their own `errors.py`.
"""

from __future__ import annotations

from enum import IntEnum
from typing import ClassVar, Final

from proto.untrusted_text import escape

_QUOTED_NAME_LENGTH: Final = 512
"""Longest invalid name that an error text quotes completely; a hostile one may have megabytes."""
_QUOTED_CONTEXT: Final = 40
"""Characters quoted before and after the invalid character of a longer name."""


class ErrorCode(IntEnum):
    """Why a session was closed or a declaration refused (docs/protocol.md §9)."""

    MALFORMED = 1
    """Bytes that are not a frame, or a frame whose fields are missing or of the wrong type."""
    TOO_LARGE = 2
    """A frame, message, name or table is over its limit."""
    UNEXPECTED = 3
    """A well-formed frame that this session state does not allow."""
    VERSION = 4
    """The two sides have no protocol version in common."""
    TIMEOUT = 5
    """The handshake or the keepalive limit passed."""
    INVALID_NAME = 6
    """A declared name breaks the naming rules."""
    NAME_TAKEN = 7
    """Another node has this full name; as ERROR: it is silent, and the sender may try again."""
    UNKNOWN_ID = 8
    """A frame refers to an endpoint or publisher that this link does not own."""
    LIMIT = 9
    """A per-connection limit (endpoints, pending requests) is reached."""
    CREDIT = 10
    """A publisher sent more than it was granted."""
    SHUTDOWN = 11
    """The broker is stopping."""
    TAKEN_OVER = 12
    """The same instance has connected again; this link is the old one."""
    INTERNAL = 13
    """A bug on the other side."""
    UNAUTHORIZED = 14
    """The broker requires credentials, and those in HELLO are missing or wrong."""
    DENIED = 15
    """The broker's access rules do not allow the declaration."""
    TLS_REQUIRED = 16
    """The port speaks TLS, and the client did not."""


class CallboardError(Exception):
    """Base class of all errors that callboard raises.

    Attributes:
        is_operational: Whether the remedy is outside the program: no broker, a name that is taken, a file or
            an environment variable. `actors.run` logs such an error in one line, and every other one with a
            traceback, as somebody has to find the line of code that causes it.
    """

    is_operational: ClassVar[bool] = False


class InvalidNameError(CallboardError, ValueError):
    """A name breaks a naming rule.

    Attributes:
        kind: The kind of name, as in the message ("node name", "topic name").
        name: The invalid name.
        reason: The broken rule, in words.
        index: Index of the first invalid character in `name`.
    """

    def __init__(self, kind: str, name: str, reason: str, index: int) -> None:
        super().__init__(kind, name, reason, index)
        self.kind = kind
        self.name = name
        self.reason = reason
        self.index = index

    def __str__(self) -> str:
        start, end, before, after = 0, len(self.name), "", ""
        if end > _QUOTED_NAME_LENGTH:
            start, end = max(0, self.index - _QUOTED_CONTEXT), min(end, self.index + _QUOTED_CONTEXT)
            before, after = "..." * (start > 0), "..." * (end < len(self.name))
        left = before + escape(self.name[start : self.index])
        right = escape(self.name[self.index : end]) + after
        return f"Invalid {self.kind}: {self.reason}:\n  '{left}{right}'\n   {' ' * len(left)}^"


class InvalidNodeNameError(InvalidNameError):
    """A node name breaks a naming rule."""


class InvalidNamespaceError(InvalidNameError):
    """A namespace breaks a naming rule."""


class InvalidTopicNameError(InvalidNameError):
    """A topic name breaks a naming rule."""


class InvalidServiceNameError(InvalidNameError):
    """A service name breaks a naming rule."""


class InvalidUrlError(CallboardError, ValueError):
    """A broker URL is invalid."""

    # Nearly always it comes from the environment or a file.
    is_operational = True


class TlsFileError(CallboardError, ValueError):
    """A file with a certificate, key or authority cannot be used; the text names it and says why."""

    is_operational = True


class ProtocolError(CallboardError):
    """The peer violated the protocol, so the session must end.

    Attributes:
        code: The code of the ERROR frame.
    """

    is_operational = True

    def __init__(self, code: ErrorCode, message: str) -> None:
        super().__init__(message)
        self.code = code
