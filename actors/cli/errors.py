"""How a command ends when it does not end well, and the exit codes.

CallboardError (proto.errors)
└── CommandError                one plain text for stderr, and an exit code
KeyboardInterrupt
└── Interrupted                 SIGINT or SIGTERM came
"""

from __future__ import annotations

from typing import Final

from actors.config.environment import InvalidEnvironmentError
from actors.errors import BrokerUnreachable
from proto.errors import CallboardError, InvalidNameError, InvalidUrlError

OK: Final = 0
FAILURE: Final = 1
USAGE: Final = 2
NO_BROKER: Final = 3
TIMEOUT: Final = 124
BROKEN_PIPE: Final = 141
"""As a shell says it of what SIGPIPE has ended."""


class CommandError(CallboardError):
    """A command cannot do what it was asked to.

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
    if isinstance(error, BrokerUnreachable):
        return NO_BROKER
    if isinstance(error, TimeoutError):
        return TIMEOUT
    if isinstance(error, InvalidNameError | InvalidUrlError | InvalidEnvironmentError):
        return USAGE
    return FAILURE
