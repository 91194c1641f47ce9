"""What can go wrong when a broker is set up, as types.

    CallboardError (proto.errors)
    ├── InvalidOptionError (ValueError)   an option is out of range; says which, and what is allowed
    └── ListenError (OSError)             the broker cannot listen where it should
        └── AddressInUseError             something else listens there

OS errors are translated here and nowhere else.
"""

from __future__ import annotations

import errno

from proto.errors import CallboardError


class InvalidOptionError(CallboardError, ValueError):
    """An option is out of range."""


class ListenError(CallboardError, OSError):
    """The broker cannot listen where it should."""


class AddressInUseError(ListenError):
    """Something else listens there."""


def listen_error(place: str, error: OSError, remedy: str) -> ListenError:
    """Return the error that says in words why listening at `place` failed."""
    if error.errno == errno.EADDRINUSE:
        return AddressInUseError(f"Cannot listen on {place}: it is in use. {remedy}")
    if error.errno in {errno.EACCES, errno.EPERM}:
        return ListenError(f"Cannot listen on {place}: permission denied. {remedy}")
    reason = error.strerror or str(error)
    return ListenError(f"Cannot listen on {place}: {reason}. {remedy}")
