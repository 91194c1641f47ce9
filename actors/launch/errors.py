"""What can be wrong with a launch.

CallboardError (proto.errors)
└── LaunchError                 the description cannot be carried out; the text says why, in one line
    ├── LaunchFileError         a launch file cannot be read, fails, or describes nothing
    └── UnknownArgumentError    nobody has declared an argument that was given
"""

from __future__ import annotations

from proto.errors import CallboardError, shown


class LaunchError(CallboardError, ValueError):
    """A description cannot be carried out; nothing has been started."""


class LaunchFileError(LaunchError):
    """A launch file cannot be read, fails when it is run, or describes nothing."""


class UnknownArgumentError(LaunchError):
    """An argument was given that no part of the description knows.

    Attributes:
        name: The argument.
        known: Those that are declared.
    """

    def __init__(self, name: str, known: tuple[str, ...]) -> None:
        super().__init__(f"No launch argument '{shown(name)}'")
        self.name = name
        self.known = known
