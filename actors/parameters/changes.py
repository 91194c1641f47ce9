"""The effect of setting, declaring or removing parameters."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from actors.parameters.types import Parameter, ParameterType

if TYPE_CHECKING:
    from collections.abc import Mapping


@dataclass(frozen=True, slots=True)
class ParameterChanges:
    """The changes of one operation.

    Attributes:
        new: Parameters that had no value before.
        changed: Parameters that had one, with the value that they have now, even if it is the same.
        deleted: Parameters that have no value any more.
    """

    new: list[Parameter]
    changed: list[Parameter]
    deleted: list[Parameter]

    @classmethod
    def between(
        cls, before: Mapping[str, Parameter | None], after: Mapping[str, Parameter]
    ) -> ParameterChanges:
        """Compare parameters with what they are now.

        Args:
            before: The parameters that may have changed, as they were; None for one that was not declared.
            after: All parameters, as they are.
        """
        changes = cls([], [], [])
        for name, old in before.items():
            now = after.get(name)
            if now is not None and now.type_ is not ParameterType.NOT_SET:
                # Also if the value is the same: ROS 2 reports every set, and a program may wait for the
                # event of its own.
                (changes.changed if _has_value(old) else changes.new).append(now)
            elif _has_value(old):
                changes.deleted.append(Parameter(name))
        return changes

    def __bool__(self) -> bool:
        return bool(self.new or self.changed or self.deleted)


def _has_value(parameter: Parameter | None) -> bool:
    return parameter is not None and parameter.type_ is not ParameterType.NOT_SET
