"""The environment variables that callboard uses; no other module in `actors` reads any.

    CALLBOARD_URL        URL of the broker, e.g. callboard://127.0.0.1:7411
    CALLBOARD_DOMAIN     graph on the broker, 0 to 232
    CALLBOARD_CONTEXT    context to use, as named with `callboard context`
    CALLBOARD_TOKEN_FILE file with the token that the broker requires
    CALLBOARD_TOKEN      the token itself; not used if there is a file
    CALLBOARD_INSECURE   1: send the token over plain TCP to other machines, too
    CALLBOARD_SHARED_MEMORY  0: send large messages as bytes to brokers on this host, too
    CALLBOARD_LOG_LEVEL  log level of scripts: DEBUG, INFO, WARN, ERROR or FATAL
    CALLBOARD_CA         PEM file with the authorities to trust for TLS; those of the system if unset
    CALLBOARD_CERT       PEM file with this client's certificate, for brokers that ask for one
    CALLBOARD_KEY        PEM file with its private key
    AMENT_PREFIX_PATH    folders that packages of ROS 2 are installed in, with interfaces in share
    XDG_CONFIG_HOME      parent folder of configuration; ~/.config if unset
    XDG_STATE_HOME       parent folder of launch logs; ~/.local/state if unset
    XDG_CACHE_HOME       parent folder of files that can be written again; ~/.cache if unset
    ROS_DOMAIN_ID        the same as CALLBOARD_DOMAIN, for programs written for ROS 2, if that is unset
    ROS_PYTHON_CHECK_FIELDS  1: programs written for ROS 2 check fields where they are assigned
    RCUTILS_CONSOLE_OUTPUT_FORMAT  such programs' log lines, as in ROS 2
    RCUTILS_COLORIZED_OUTPUT       1: such programs colour log lines; 0: they do not
    RCUTILS_LOGGING_USE_STDOUT     1: such programs write the log to stdout
    NO_COLOR             set to anything: no colours
    FORCE_COLOR          set to anything: colours, also where there is no terminal

An empty variable is treated as unset. Options in code or on a command line take precedence. In a contextvars
context with a `stand_in`, that is read instead.
"""

from __future__ import annotations

import os
import re
from contextvars import ContextVar
from typing import TYPE_CHECKING, Final

from actors.config.ros_domain import ROS_DOMAIN, parse_ros_domain
from proto.errors import CallboardError
from proto.limits import MAX_DOMAIN
from proto.untrusted_text import escape
from proto.wire.tls import TlsFiles

if TYPE_CHECKING:
    from collections.abc import Mapping

VARIABLES: Final = (
    *("CALLBOARD_URL", "CALLBOARD_DOMAIN", "CALLBOARD_CONTEXT", "CALLBOARD_LOG_LEVEL"),
    *("CALLBOARD_TOKEN_FILE", "CALLBOARD_TOKEN", "CALLBOARD_INSECURE"),
    *("CALLBOARD_CA", "CALLBOARD_CERT", "CALLBOARD_KEY", "CALLBOARD_SHARED_MEMORY"),
)
"""Those that are callboard's own."""

CHOOSING_VARIABLES: Final = (*VARIABLES, ROS_DOMAIN)
"""Those that choose the broker or the graph of a program, which a test chooses itself."""

LOG_LEVELS: Final = ("DEBUG", "INFO", "WARN", "ERROR", "FATAL")

stand_in: Final[ContextVar[Mapping[str, str] | None]] = ContextVar("callboard_environment", default=None)
"""The environment of a node that shares its process with others; None: that of the process."""

_DOMAIN = re.compile(r"[0-9]{1,3}")


class InvalidEnvironmentError(CallboardError, ValueError):
    """An environment variable has an invalid value; the text gives the valid ones."""

    is_operational = True

    def __init__(self, variable: str, value: str, expected: str) -> None:
        super().__init__(f"{variable} must be {expected}, not '{escape(value)}'")
        self.variable = variable
        self.value = value


def broker_url(environ: Mapping[str, str] | None = None) -> str | None:
    """Return CALLBOARD_URL unparsed, None if unset."""
    return _get("CALLBOARD_URL", environ)


def domain_id(environ: Mapping[str, str] | None = None, *, ros: bool = False) -> int | None:
    """Return CALLBOARD_DOMAIN, None if unset.

    Args:
        environ: The variables; None for those of the process.
        ros: For a program written for ROS 2: if it is unset, return ROS_DOMAIN_ID.

    Raises:
        InvalidEnvironmentError: It is not an integer from 0 to `MAX_DOMAIN`.
    """
    value = _get("CALLBOARD_DOMAIN", environ)
    if value is None:
        return ros_domain_id(environ) if ros else None
    if not _DOMAIN.fullmatch(value) or int(value) > MAX_DOMAIN:
        raise InvalidEnvironmentError("CALLBOARD_DOMAIN", value, f"an integer from 0 to {MAX_DOMAIN}")
    return int(value)


def ros_domain_id(environ: Mapping[str, str] | None) -> int | None:
    """Return ROS_DOMAIN_ID, None if unset."""
    value = _get(ROS_DOMAIN, environ)
    if value is None:
        return None
    number = parse_ros_domain(value)
    if number is not None:
        return number
    raise InvalidEnvironmentError(ROS_DOMAIN, value, f"an integer from 0 to {MAX_DOMAIN}")


def ignored_ros_domain(domain: int, environ: Mapping[str, str] | None = None) -> str | None:
    """Return the warning that a process does not use ROS_DOMAIN_ID; None if there is no reason for it.

    Args:
        domain: The domain that it uses.
        environ: The variables; None for those of the process.
    """
    if _get("CALLBOARD_DOMAIN", environ) is not None:
        return None
    try:
        number = ros_domain_id(environ)
    except InvalidEnvironmentError:
        return None
    if number is None or number == domain:
        return None
    return (
        f"{ROS_DOMAIN}={number} counts for programs that run with --ros only, and this one uses domain"
        f" {domain}: export CALLBOARD_DOMAIN={number} to be with them, or CALLBOARD_DOMAIN={domain} if it is"
        " meant"
    )


def context_name(environ: Mapping[str, str] | None = None) -> str | None:
    """Return CALLBOARD_CONTEXT unchecked, None if unset."""
    return _get("CALLBOARD_CONTEXT", environ)


def token_file() -> str | None:
    """Return CALLBOARD_TOKEN_FILE, None if unset."""
    return _get("CALLBOARD_TOKEN_FILE", None)


def token() -> str | None:
    """Return CALLBOARD_TOKEN, None if unset."""
    return _get("CALLBOARD_TOKEN", None)


def insecure(environ: Mapping[str, str] | None = None) -> bool:
    """Return whether CALLBOARD_INSECURE is 1.

    Raises:
        InvalidEnvironmentError: It is neither 1 nor 0.
    """
    return _is_on("CALLBOARD_INSECURE", "0", environ)


def allows_shared_memory(environ: Mapping[str, str] | None = None) -> bool:
    """Return whether CALLBOARD_SHARED_MEMORY is not 0.

    Raises:
        InvalidEnvironmentError: It is neither 1 nor 0.
    """
    return _is_on("CALLBOARD_SHARED_MEMORY", "1", environ)


def _is_on(variable: str, default: str, environ: Mapping[str, str] | None) -> bool:
    value = _get(variable, environ) or default
    if value not in {"0", "1"}:
        raise InvalidEnvironmentError(variable, value, "1 or 0")
    return value == "1"


def tls_files(environ: Mapping[str, str] | None = None) -> TlsFiles:
    """Return the files in CALLBOARD_CA, CALLBOARD_CERT and CALLBOARD_KEY."""
    names = ("CALLBOARD_CA", "CALLBOARD_CERT", "CALLBOARD_KEY")
    return TlsFiles(*(_get(name, environ) or "" for name in names))


def is_journal(descriptor: int, environ: Mapping[str, str] | None = None) -> bool:
    """Return whether what is written to a file goes to the journal of systemd, which others may read.

    Args:
        descriptor: Of the file.
        environ: The environment; None for that of the process.
    """
    found = os.fstat(descriptor)
    return _source(environ).get("JOURNAL_STREAM") == f"{found.st_dev}:{found.st_ino}"


def own_variables(environ: Mapping[str, str] | None = None) -> dict[str, str]:
    """Return all non-empty variables with callboard's prefix, known or not; "..." instead of a token."""
    return {
        name: "..." if name == "CALLBOARD_TOKEN" else value
        for name, value in _source(environ).items()
        if name.startswith("CALLBOARD_") and value
    }


def foreign_variables(environ: Mapping[str, str] | None = None) -> dict[str, str]:
    """Return all variables except callboard's own."""
    return {name: value for name, value in _source(environ).items() if name not in VARIABLES}


def variables_for_tests(environ: Mapping[str, str] | None = None) -> dict[str, str]:
    """Return all variables except `CHOOSING_VARIABLES`, for programs of a test."""
    return {name: value for name, value in _source(environ).items() if name not in CHOOSING_VARIABLES}


def config_folder(environ: Mapping[str, str] | None = None) -> str:
    """Return the folder of callboard's configuration, which need not exist."""
    return _own_folder("XDG_CONFIG_HOME", "~/.config", environ)


def state_folder(environ: Mapping[str, str] | None = None) -> str:
    """Return the folder of callboard's logs, which need not exist."""
    return _own_folder("XDG_STATE_HOME", "~/.local/state", environ)


def cache_folder(environ: Mapping[str, str] | None = None) -> str:
    """Return the folder of what callboard can write again, which need not exist."""
    return _own_folder("XDG_CACHE_HOME", "~/.cache", environ)


def log_level(environ: Mapping[str, str] | None = None) -> str | None:
    """Return CALLBOARD_LOG_LEVEL, in its own case, None if unset.

    Raises:
        InvalidEnvironmentError: It is not a level, in any case.
    """
    value = _get("CALLBOARD_LOG_LEVEL", environ)
    if value is not None and value.upper() not in LOG_LEVELS:
        raise InvalidEnvironmentError("CALLBOARD_LOG_LEVEL", value, f"one of {', '.join(LOG_LEVELS)}")
    return value


def checks_fields(environ: Mapping[str, str] | None = None) -> bool:
    """Return whether ROS_PYTHON_CHECK_FIELDS is 1."""
    return _get("ROS_PYTHON_CHECK_FIELDS", environ) == "1"


def ament_prefixes(environ: Mapping[str, str] | None = None) -> list[str]:
    """Return the folders in AMENT_PREFIX_PATH in order."""
    return [each for each in (_get("AMENT_PREFIX_PATH", environ) or "").split(os.pathsep) if each]


def color_wish(environ: Mapping[str, str] | None = None) -> bool | None:
    """Return False for no colours, True for colours everywhere, None for colours on terminals only."""
    if _get("NO_COLOR", environ) is not None:
        return False
    if _get("FORCE_COLOR", environ) is not None:
        return True
    return False if dumb_terminal(environ) else None


def dumb_terminal(environ: Mapping[str, str] | None = None) -> bool:
    """Return whether TERM is a terminal that cannot redraw."""
    return _get("TERM", environ) == "dumb"


def environment_for(extra: Mapping[str, str]) -> dict[str, str] | None:
    """Return the environment of a child with more variables; None if it is that of this process."""
    return {**_source(None), **extra} if extra or stand_in.get() is not None else None


def _own_folder(variable: str, usual: str, environ: Mapping[str, str] | None) -> str:
    base = _get(variable, environ) or ""
    # Every command and node runs this, and importing pathlib takes some milliseconds.
    if not os.path.isabs(base):  # noqa: PTH117 - the XDG standard says to ignore it
        base = os.path.expanduser(usual)  # noqa: PTH111
    return os.path.join(base, "callboard")  # noqa: PTH118


def _get(variable: str, environ: Mapping[str, str] | None) -> str | None:
    return _source(environ).get(variable) or None


def _source(environ: Mapping[str, str] | None) -> Mapping[str, str]:
    """Return the given environment, else the context's, else the process's."""
    if environ is not None:
        return environ
    here = stand_in.get()
    return os.environ if here is None else here
