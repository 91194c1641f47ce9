"""Names of ROS 2 that callboard does not have."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NoReturn

from actors.launch import LaunchError

if TYPE_CHECKING:
    from collections.abc import Callable


def unsupported(name: str, remedy: str) -> Callable[..., Any]:
    """Return a function that says that there is no such class.

    Args:
        name: The class.
        remedy: What to do instead.
    """

    def refuse(*args: object, **kwargs: object) -> NoReturn:
        raise LaunchError(f"callboard has no {name}: {remedy}")

    refuse.__name__ = name
    return refuse
