"""Names of ROS 2 that callboard does not have.

Launch files often have such actions in branches that are not taken, as nav2's with `use_composition:=False`.
So objects of most of these classes can be created, and it is an error to carry them out.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar, NoReturn

from actors.launch import EmitEvent as CallboardEmitEvent, LaunchError
from actors.launch.description.actions import UnsupportedAction
from actors.launch.description.validation import Entity

if TYPE_CHECKING:
    from collections.abc import Callable

    from actors.launch.description.conditions import Condition


def unsupported(name: str, remedy: str) -> Callable[..., Any]:
    """Return a function in place of a class, which raises the error when it is called.

    Args:
        name: The class.
        remedy: What to do instead.
    """

    def refuse(*args: object, **kwargs: object) -> NoReturn:
        raise _error(name, remedy)

    refuse.__name__ = name
    return refuse


def unsupported_action(name: str, remedy: str) -> type[UnsupportedAction]:
    """Return a class of actions that cannot be carried out.

    Args:
        name: The class.
        remedy: What to do instead.
    """
    return type(name, (_UnsupportedAction,), {"remedy_text": remedy})


def unsupported_event(name: str, remedy: str) -> type[Entity]:
    """Return a class of events that `EmitEvent` cannot emit.

    Args:
        name: The class.
        remedy: What to do instead.
    """
    return type(name, (_UnsupportedEvent,), {"remedy": remedy})


class _UnsupportedAction(UnsupportedAction):
    remedy_text: ClassVar[str]

    def __init__(
        self, *_args: object, name: object = None, condition: Condition | None = None, **_kwargs: object
    ) -> None:
        super().__init__(action_type=type(self).__name__, remedy=self.remedy_text, condition=condition)
        object.__setattr__(self, "name", name)  # for its label in the error


@dataclass(frozen=True, init=False)
class _UnsupportedEvent(Entity):
    kind: ClassVar[str] = "event"
    remedy: ClassVar[str]

    def __init__(self, *_args: object, **_kwargs: object) -> None:
        pass


class EmitEvent(CallboardEmitEvent):
    """Cause an event: `ChangeState`, or `Shutdown`."""

    @property
    def execute(self) -> NoReturn:
        """Raise the error of an unsupported event; planning knows the others."""
        raise _error(type(self.event).__name__, getattr(self.event, "remedy", "use Shutdown or ChangeState"))


def _error(name: str, remedy: str) -> LaunchError:
    return LaunchError(f"callboard has no {name}: {remedy}")
