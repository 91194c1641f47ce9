"""Settings that save and restore arguments and environment variables, or take them from files.

PushLaunchConfigurations(), SetLaunchConfiguration("speed", "2"), …, PopLaunchConfigurations()
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from actors.launch.description.action import Setting

if TYPE_CHECKING:
    from collections.abc import Mapping

    from actors.launch.description.substitutions import Text


@dataclass(frozen=True, kw_only=True)
class PushLaunchConfigurations(Setting):
    """Save the arguments and their values, until `PopLaunchConfigurations`.

    Attributes:
        condition: When to carry it out; None: always.
    """


@dataclass(frozen=True, kw_only=True)
class PopLaunchConfigurations(Setting):
    """Restore the arguments that were saved last in this group or file.

    Attributes:
        condition: When to carry it out; None: always.
    """


@dataclass(frozen=True)
class ResetLaunchConfigurations(Setting):
    """Forget all arguments, except for these.

    Attributes:
        launch_configurations: Arguments and their values. They are evaluated before the others are forgotten.
        condition: When to carry it out; None: always.
    """

    launch_configurations: Mapping[str, Text] = field(default_factory=dict[str, "Text"])


@dataclass(frozen=True)
class UnsetLaunchConfiguration(Setting):
    """Remove an argument. One that is not set stays so.

    Attributes:
        name: The argument.
        condition: When to carry it out; None: always.
    """

    name: Text


@dataclass(frozen=True, kw_only=True)
class PushEnvironment(Setting):
    """Save the environment of programs, until `PopEnvironment`.

    Attributes:
        condition: When to carry it out; None: always.
    """


@dataclass(frozen=True, kw_only=True)
class PopEnvironment(Setting):
    """Restore the environment that was saved last in this group or file.

    Attributes:
        condition: When to carry it out; None: always.
    """


@dataclass(frozen=True, kw_only=True)
class ResetEnvironment(Setting):
    """Give programs the environment that they had at the beginning of the launch.

    Attributes:
        condition: When to carry it out; None: always.
    """


@dataclass(frozen=True)
class SetParametersFromFile(Setting):
    """Set the parameters of a YAML file for nodes; `SetParameter` and a node's own have precedence.

    Applies from here to the end of the group or file.

    Attributes:
        filename: The file; a relative path starts at the folder of the launch file.
        condition: When to carry it out; None: always.
    """

    filename: Text
