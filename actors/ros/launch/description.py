"""The description of a launch, and base classes for actions and conditions of users."""

from __future__ import annotations

from abc import ABC, ABCMeta
from typing import TYPE_CHECKING, Any

from actors.launch import LaunchDescription as CallboardDescription
from actors.launch.description.action import Action as CallboardAction
from actors.launch.description.conditions import Condition as CallboardCondition
from actors.launch.description.description import declared_arguments, format_actions
from actors.launch.description.description_source import AnyLaunchDescriptionSource
from actors.launch.description.substitutions import Text

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence

    from actors.launch import DeclareLaunchArgument, LaunchContext

SomeSubstitutionsType = Text
SomeEntitiesType = Any
LaunchDescriptionSource = AnyLaunchDescriptionSource


class _AnyAction(ABCMeta):
    def __instancecheck__(cls, instance: object) -> bool:
        return isinstance(instance, CallboardAction) if cls is Action else super().__instancecheck__(instance)


class Action(CallboardAction, metaclass=_AnyAction):
    """Base class of users' actions, which override `execute`; for `isinstance`, of all actions."""

    def execute(self, context: LaunchContext) -> Sequence[CallboardAction] | None:
        """Return further actions.

        Args:
            context: The arguments, variables and settings that apply to it.
        """


class Condition(CallboardCondition):
    """A condition that calls a function.

    Args:
        predicate: Called with the context.
    """

    def __init__(self, *, predicate: Callable[[LaunchContext], bool]) -> None:
        self._predicate = predicate

    def evaluate(self, context: LaunchContext) -> bool:
        """Call the function."""
        return self._predicate(context)


class LaunchDescription(CallboardDescription):
    """The actions of a launch, in order.

    Args:
        initial_entities: Actions, and descriptions whose actions are added.
        deprecated_reason: Ignored.
    """

    def __init__(
        self, initial_entities: Iterable[Any] | None = None, *, deprecated_reason: str | None = None
    ) -> None:
        super().__init__(())
        for each in initial_entities or ():
            self.add_entity(each)

    def add_entity(self, entity: Any) -> None:
        """Add an action, or the actions of a description."""
        for each in entity.actions if isinstance(entity, CallboardDescription) else (entity,):
            self.add_action(each)

    @property
    def entities(self) -> list[CallboardAction]:
        """The actions."""
        return list(self.actions)

    def get_launch_arguments(self) -> list[DeclareLaunchArgument]:
        """Return the arguments that are declared, except in included files."""
        return declared_arguments(self.actions)


class LaunchDescriptionEntity(ABC):  # noqa: B024 - a class, for annotations such as `List[...]`
    """Base class, for `isinstance` and annotations, of actions and descriptions."""


LaunchDescriptionEntity.register(CallboardAction)
LaunchDescriptionEntity.register(CallboardDescription)


class LaunchIntrospector:
    """Formats descriptions as text; the format is callboard's."""

    def format_launch_description(self, launch_description: CallboardDescription) -> str:
        """Return a description as text, an action a line."""
        return "\n".join(format_actions(launch_description.actions))
