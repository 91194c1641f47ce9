"""The errors of commands, and their exit codes.

CallboardError (proto.errors)
└── CommandError                a message for stderr, and an exit code
KeyboardInterrupt
└── Interrupted                 SIGINT or SIGTERM arrived
"""

from __future__ import annotations

from typing import Final

from actors.config.environment import InvalidEnvironmentError
from actors.errors import BrokerUnreachable, NotAuthorized
from proto.errors import CallboardError, InvalidNameError, InvalidUrlError, TlsFileError

OK: Final = 0
FAILURE: Final = 1
USAGE: Final = 2
NO_BROKER: Final = 3
TIMEOUT: Final = 124
BROKEN_PIPE: Final = 141
"""As shells report a process that SIGPIPE killed."""


class CommandError(CallboardError):
    """A command failed.

    Attributes:
        code: The exit code.
    """

    def __init__(self, text: str, code: int = FAILURE) -> None:
        super().__init__(text)
        self.code = code


def exit_code(error: CallboardError) -> int:
    """Return the exit code that an error means."""
    if isinstance(error, CommandError):
        return error.code
    if isinstance(error, BrokerUnreachable | NotAuthorized | TlsFileError):
        return NO_BROKER
    if isinstance(error, TimeoutError):
        return TIMEOUT
    if isinstance(error, InvalidNameError | InvalidUrlError | InvalidEnvironmentError):
        return USAGE
    return FAILURE
