"""Actions and event handlers: what all of them have."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Any, ClassVar, TypeAlias

from actors.launch.description.options import option
from actors.launch.description.validation import Entity

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from actors.launch.description.conditions import Condition

Actions: TypeAlias = "Action | Sequence[Action]"
Reaction: TypeAlias = "Actions | Callable[..., Actions | None]"
"""What an event handler does. A function is called with the event and the `LaunchContext`."""


@dataclass(frozen=True, kw_only=True)
class Action(Entity):
    """An action of a description.

    Subclasses of users have `execute`, which is called with the `LaunchContext` and returns actions.

    Raises:
        LaunchError: An option has a value of the wrong type.
    """

    kind: ClassVar[str] = "action"

    condition: Condition | None = option(None, "When to carry it out; by default always.", keys="")


@dataclass(frozen=True, kw_only=True)
class Setting(Action):
    """An action that applies from here to the end of the group or file."""


@dataclass(frozen=True, kw_only=True)
class EventHandler(Entity):
    """An event handler.

    Subclasses of users have `matcher`, which is called with each event and returns whether it is handled, and
    `entities`, the reaction.

    Raises:
        LaunchError: An option has a value of the wrong type.
    """

    kind: ClassVar[str] = "event handler"

    handle_once: bool = option(False, "Whether to react only the first time.", keys="once")

    @property
    def actions(self) -> Sequence[Action]:
        """The actions of its reactions, as far as they are known before."""
        names = (each.name for each in fields(self))
        reactions = [getattr(self, each) for each in names if each.startswith("on_") or each == "entities"]
        return [action for each in reactions if each is not None for action in known_actions(each)]


def known_actions(reaction: Any) -> Sequence[Action]:
    """Return the actions of a reaction; none if it is a function."""
    if isinstance(reaction, Action):
        return (reaction,)
    return () if callable(reaction) else tuple(reaction)
