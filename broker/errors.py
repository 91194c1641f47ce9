"""What can go wrong when a broker is set up, as types.

    CallboardError (proto.errors)
    ├── InvalidOptionError (ValueError)   an option is out of range; says which, and what is allowed
    └── ListenError (OSError)             the broker cannot listen where it should
        └── AddressInUseError             something else listens there

OS errors are translated here and nowhere else.
"""

from __future__ import annotations

import errno
import socket

from proto.errors import CallboardError


class InvalidOptionError(CallboardError, ValueError):
    """An option is out of range."""


class ListenError(CallboardError, OSError):
    """The broker cannot listen where it should."""


class AddressInUseError(ListenError):
    """Something else listens there."""


def listen_error(place: str, error: OSError | UnicodeError, *, host: str, moving: str) -> ListenError:
    """Return the error that says in words why listening at `place` failed, and what to do.

    Args:
        place: The URL.
        error: What the system said; a UnicodeError if the host cannot be a name at all.
        host: The host of that URL; "" for a socket file.
        moving: How to choose another place.
    """
    remedy = "Use an address of this machine with --host: 127.0.0.1, or 0.0.0.0 for all its addresses"
    if isinstance(error, socket.gaierror | UnicodeError):
        reason = f"the name '{host}' cannot be resolved"
    elif error.errno == errno.EADDRNOTAVAIL and host:
        reason = f"this machine does not have the address '{host}'"
    else:
        denied = error.errno in {errno.EACCES, errno.EPERM}
        reason = "permission denied" if denied else error.strerror or str(error)
        remedy = moving
    return ListenError(f"Cannot listen on {place}: {reason}. {remedy}.")


def address_in_use_error(place: str, broker: str | None, *, moving: str) -> AddressInUseError:
    """Return the error that says what has the place already.

    Args:
        place: The URL.
        broker: What the callboard broker there calls itself; None if nothing there answers as one does.
        moving: How to choose another place.
    """
    if broker is not None:
        text = f"a callboard broker ({broker}) is already running there. Use that one, or stop it"
    else:
        text = "it is in use, and what listens there does not answer as a callboard broker. Stop it"
    return AddressInUseError(f"Cannot listen on {place}: {text}. {moving}.")
