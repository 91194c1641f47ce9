"""What can be wrong with a launch.

CallboardError (proto.errors)
└── LaunchError                 the description cannot be carried out; the text says why, in one line
    ├── LaunchFileError         a launch file cannot be read, fails, or describes nothing
    │   └── NoLaunchFileError   there is none
    └── UnknownArgumentError    nobody has declared an argument that was given
"""

from __future__ import annotations

from proto.errors import CallboardError, escape


class LaunchError(CallboardError, ValueError):
    """A description cannot be carried out.

    Attributes:
        placed: Whether the text says where the mistake is.
    """

    placed: bool = False


class LaunchFileError(LaunchError):
    """A launch file cannot be read, fails when it is run, or describes nothing."""

    placed = True


class NoLaunchFileError(LaunchFileError):
    """There is no such launch file; who wants it is to be said."""

    placed = False


class UnknownArgumentError(LaunchError):
    """An argument was given that no part of the description knows.

    Attributes:
        name: The argument.
        known: Those that are declared.
    """

    def __init__(self, name: str, known: tuple[str, ...]) -> None:
        super().__init__(f"No launch argument '{escape(name)}'")
        self.name = name
        self.known = known
