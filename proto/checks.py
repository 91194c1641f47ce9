"""Checks of arguments that several public classes take."""

from __future__ import annotations

from proto.limits import MAX_DOMAIN


def require_domain(domain: object) -> None:
    """Check the number of a graph.

    Raises:
        TypeError: It is not an int.
        ValueError: It is not from 0 to 232.
    """
    if type(domain) is not int:
        raise TypeError(f"domain must be an int, not {type(domain).__name__}")
    if not 0 <= domain <= MAX_DOMAIN:
        raise ValueError(f"domain must be from 0 to {MAX_DOMAIN}, not {domain}")


def require_seconds(name: str, value: object) -> None:
    """Check a time, which may be infinite.

    Args:
        name: The argument's name, for the error.
        value: The time in seconds.

    Raises:
        TypeError: It is not a number.
        ValueError: It is negative or NaN.
    """
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise TypeError(f"{name} must be a number of seconds, not {type(value).__name__}")
    if not value >= 0:
        raise ValueError(f"{name} must be zero or more seconds, not {value}")
