"""The environment variables that callboard knows; nothing else in `actors` reads any.

    CALLBOARD_URL        where the broker is, e.g. callboard://127.0.0.1:7411
    CALLBOARD_DOMAIN     which of the broker's separate graphs to join, 0 to 232
    CALLBOARD_CONTEXT    which of the brokers named with `callboard context` to go to
    CALLBOARD_LOG_LEVEL  what scripts log: DEBUG, INFO, WARN, ERROR or FATAL
    XDG_CONFIG_HOME      where configuration is kept; ~/.config if unset
    XDG_STATE_HOME       where logs of launches are kept; ~/.local/state if unset
    NO_COLOR             set to anything: no colours
    FORCE_COLOR          set to anything: colours, also where there is no terminal

An empty variable counts as unset. Options given in code or on a command line go before all of them. In a
context that has a `stand_in`, that is read instead.
"""

from __future__ import annotations

import os
import re
from contextvars import ContextVar
from typing import TYPE_CHECKING, Final

from proto.errors import CallboardError, escape

if TYPE_CHECKING:
    from collections.abc import Mapping

VARIABLES: Final = ("CALLBOARD_URL", "CALLBOARD_DOMAIN", "CALLBOARD_CONTEXT", "CALLBOARD_LOG_LEVEL")
"""Those that are callboard's own."""

MAX_DOMAIN: Final = 232
"""Highest domain id, as in ROS 2."""

LOG_LEVELS: Final = ("DEBUG", "INFO", "WARN", "ERROR", "FATAL")

stand_in: Final[ContextVar[Mapping[str, str] | None]] = ContextVar("callboard_environment", default=None)
"""The environment of a node that shares its process with others; None: the process's."""

_DOMAIN = re.compile(r"[0-9]{1,3}")


class InvalidEnvironmentError(CallboardError, ValueError):
    """An environment variable has a value that it cannot have; the text says which one can stand there."""

    def __init__(self, variable: str, value: str, expected: str) -> None:
        super().__init__(f"{variable} must be {expected}, not '{escape(value)}'")
        self.variable = variable
        self.value = value


def broker_url(environ: Mapping[str, str] | None = None) -> str | None:
    """Return CALLBOARD_URL as it stands, None if unset. The caller parses it."""
    return _get("CALLBOARD_URL", environ)


def domain_id(environ: Mapping[str, str] | None = None) -> int | None:
    """Return CALLBOARD_DOMAIN, None if unset.

    Raises:
        InvalidEnvironmentError: It is not an integer from 0 to `MAX_DOMAIN`.
    """
    value = _get("CALLBOARD_DOMAIN", environ)
    if value is None:
        return None
    if not _DOMAIN.fullmatch(value) or int(value) > MAX_DOMAIN:
        raise InvalidEnvironmentError("CALLBOARD_DOMAIN", value, f"an integer from 0 to {MAX_DOMAIN}")
    return int(value)


def context_name(environ: Mapping[str, str] | None = None) -> str | None:
    """Return CALLBOARD_CONTEXT as it stands, None if unset. `actors.config.contexts` knows what it names."""
    return _get("CALLBOARD_CONTEXT", environ)


def own_variables(environ: Mapping[str, str] | None = None) -> dict[str, str]:
    """Return all variables that are named like callboard's own and have a value, known or not."""
    return {
        name: value for name, value in _source(environ).items() if name.startswith("CALLBOARD_") and value
    }


def foreign_variables(environ: Mapping[str, str] | None = None) -> dict[str, str]:
    """Return all variables but those that are callboard's own: what programs of a test get."""
    return {name: value for name, value in _source(environ).items() if name not in VARIABLES}


def config_folder(environ: Mapping[str, str] | None = None) -> str:
    """Return where callboard's configuration is kept; the folder need not exist."""
    return _own_folder("XDG_CONFIG_HOME", "~/.config", environ)


def state_folder(environ: Mapping[str, str] | None = None) -> str:
    """Return where callboard's logs are kept; the folder need not exist."""
    return _own_folder("XDG_STATE_HOME", "~/.local/state", environ)


def log_level(environ: Mapping[str, str] | None = None) -> str | None:
    """Return CALLBOARD_LOG_LEVEL as it stands, None if unset.

    Raises:
        InvalidEnvironmentError: It is no level, in whatever case.
    """
    value = _get("CALLBOARD_LOG_LEVEL", environ)
    if value is not None and value.upper() not in LOG_LEVELS:
        raise InvalidEnvironmentError("CALLBOARD_LOG_LEVEL", value, f"one of {', '.join(LOG_LEVELS)}")
    return value


def color_wish(environ: Mapping[str, str] | None = None) -> bool | None:
    """Return False if colours are unwanted, True if wanted everywhere, None to let the terminal decide."""
    if _get("NO_COLOR", environ) is not None:
        return False
    if _get("FORCE_COLOR", environ) is not None:
        return True
    return False if dumb_terminal(environ) else None


def dumb_terminal(environ: Mapping[str, str] | None = None) -> bool:
    """Tell whether TERM says that nothing can be drawn: what is written stays."""
    return _get("TERM", environ) == "dumb"


def environment_for(extra: Mapping[str, str]) -> dict[str, str] | None:
    """Return the environment with more variables, for a child; None if that is this process's own."""
    return {**_source(None), **extra} if extra or stand_in.get() is not None else None


def _own_folder(variable: str, usual: str, environ: Mapping[str, str] | None) -> str:
    base = _get(variable, environ) or ""
    # Every command and node comes by here: importing pathlib would take it some milliseconds.
    if not os.path.isabs(base):  # noqa: PTH117 - the standard says to ignore it then
        base = os.path.expanduser(usual)  # noqa: PTH111
    return os.path.join(base, "callboard")  # noqa: PTH118


def _get(variable: str, environ: Mapping[str, str] | None) -> str | None:
    return _source(environ).get(variable) or None


def _source(environ: Mapping[str, str] | None) -> Mapping[str, str]:
    """Return the environment that counts: the one that was given, the context's, or the process's."""
    if environ is not None:
        return environ
    here = stand_in.get()
    return os.environ if here is None else here
