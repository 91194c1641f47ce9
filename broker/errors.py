"""Errors of setting up a broker.

    CallboardError (proto.errors)
    ├── AccessFileError (ValueError)      the access rules are broken or cannot be read (broker.access.errors)
    ├── ConfigurationError (ValueError)   the configuration file is wrong; the text names the key
    ├── InvalidOptionError (ValueError)   an option is out of range; the text names it and its range
    └── ListenError (OSError)             the broker cannot listen where it should
        ├── AddressInUseError             something else listens there
        └── UnprotectedError              other machines could connect, and anybody would be let in

OS errors are translated only here.
"""

from __future__ import annotations

import errno
import socket

from proto.errors import CallboardError


class ConfigurationError(CallboardError, ValueError):
    """The configuration file cannot be read or is wrong."""

    is_operational = True


class InvalidOptionError(CallboardError, ValueError):
    """An option is out of range."""


class ListenError(CallboardError, OSError):
    """The broker cannot listen where it should."""

    is_operational = True


class AddressInUseError(ListenError):
    """Something else listens there."""


class UnprotectedError(ListenError):
    """Other machines could connect, and the broker would let in anybody."""


def listen_error(url: str, error: OSError | UnicodeError, *, host: str, remedy: str) -> ListenError:
    """Return the error that says why listening failed, and what to do.

    Args:
        url: Where the broker should listen.
        error: The system's error; a UnicodeError if the host cannot be a name at all.
        host: The host of that URL; "" for a socket file.
        remedy: How to choose another place.
    """
    other_host = "Use an address of this machine with --host: 127.0.0.1, or 0.0.0.0 for all its addresses"
    if isinstance(error, socket.gaierror | UnicodeError):
        reason, remedy = f"the name '{host}' cannot be resolved", other_host
    elif error.errno == errno.EADDRNOTAVAIL and host:
        reason, remedy = f"this machine does not have the address '{host}'", other_host
    else:
        denied = error.errno in {errno.EACCES, errno.EPERM}
        reason = "permission denied" if denied else error.strerror or str(error)
    return ListenError(f"Cannot listen on {url}: {reason}. {remedy}.")


def unprotected_error(url: str) -> UnprotectedError:
    """Return the error about a broker that other machines reach and that asks nobody who they are."""
    return UnprotectedError(
        f"Refusing to listen on {url}: anybody who reaches this machine could take part. Say who may with"
        " --auth FILE (`callboard auth add NAME` writes one) or --tls-client-ca FILE, or let everybody in"
        " with --insecure."
    )


def address_in_use_error(url: str, broker: str | None, *, remedy: str) -> AddressInUseError:
    """Return the error that says what listens there already.

    Args:
        url: Where the broker should listen.
        broker: The agent of the callboard broker there; None if nothing there answers as one.
        remedy: How to choose another place.
    """
    if broker is not None:
        text = f"a callboard broker ({broker}) is already running there. Use that one, or stop it"
    else:
        text = "it is in use, and what listens there does not answer as a callboard broker. Stop it"
    return AddressInUseError(f"Cannot listen on {url}: {text}. {remedy}.")
