"""Where the page is served, checked before anything else starts."""

from __future__ import annotations

import socket
from importlib.util import find_spec
from typing import Final

from actors.cli.errors import USAGE, CommandError
from proto.extras import install_command

DEFAULT_LISTEN: Final = "127.0.0.1:7412"


def split_listen(listen: str, flag: str) -> tuple[str, int]:
    """Return the host and the port of `HOST:PORT`.

    Args:
        listen: The value on the command line.
        flag: Where, for the error.

    Raises:
        CommandError: It is no such address.
    """
    host, _, port = listen.rpartition(":")
    if not host or not port.isdecimal() or int(port) > 65535:
        raise CommandError(f"{flag} needs HOST:PORT, such as {DEFAULT_LISTEN}, not '{listen}'", USAGE)
    return host.strip("[]"), int(port)


def require_packages(code: int) -> None:
    """Raise unless the packages of the page are installed.

    Args:
        code: The exit code.

    Raises:
        CommandError: They are not.
    """
    if find_spec("aiohttp") is None or find_spec("prometheus_client") is None:
        raise CommandError(f"The page needs more packages: {install_command('web')}", code)


def check_web(listen: str, flag: str) -> None:
    """Check before a start that the page can be served.

    Args:
        listen: Where, as HOST:PORT.
        flag: The option that wants it, for errors.

    Raises:
        CommandError: A package is missing, or the address cannot be used; the exit code is 2.
    """
    host, port = split_listen(listen, flag)
    require_packages(USAGE)
    try:
        family = socket.AF_INET6 if ":" in host else socket.AF_INET
        socket.create_server((host, port), family=family).close()
    except OSError as error:  # its number may be that of a resolver, and its text repeats the address
        reason = str(error.strerror).partition(" (while")[0]
        raise CommandError(f"{flag}: cannot listen on {listen}: {reason}", USAGE) from None
