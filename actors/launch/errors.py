"""The errors of a launch.

CallboardError (proto.errors)
└── LaunchError                 the description cannot be carried out; the text says why, in one line
    ├── LaunchFileError         a launch file cannot be read, fails, or describes nothing
    │   └── NoLaunchFileError   the file or its package does not exist
    └── UnknownArgumentError    an argument was given that is not declared
"""

from __future__ import annotations

from proto.errors import CallboardError
from proto.untrusted_text import escape


class LaunchError(CallboardError, ValueError):
    """A description cannot be carried out.

    Attributes:
        has_location: Whether the text says where the error is.
    """

    has_location: bool = False


class LaunchFileError(LaunchError):
    """A launch file cannot be read, fails when it is run, or describes nothing."""

    is_operational = True

    has_location = True


class NoLaunchFileError(LaunchFileError):
    """There is no such launch file; the caller adds where it was requested."""

    # The path that it names is not where the error is: an include has to be corrected in its own file.
    has_location = False


class UnknownArgumentError(LaunchError):
    """An argument was given that the description neither declares nor uses.

    Attributes:
        name: The argument.
        known: The declared arguments.
    """

    def __init__(self, name: str, known: tuple[str, ...]) -> None:
        super().__init__(f"No launch argument '{escape(name)}'")
        self.name = name
        self.known = known
