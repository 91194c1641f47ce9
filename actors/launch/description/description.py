"""A launch description, and its text."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import KW_ONLY, dataclass
from typing import TYPE_CHECKING, Any, cast

from actors.launch.description.action import Action
from actors.launch.description.actions import DeclareLaunchArgument
from actors.launch.description.summaries import format_entity
from actors.launch.description.validation import excerpt
from actors.launch.errors import LaunchError

if TYPE_CHECKING:
    from collections.abc import Iterator


@dataclass
class LaunchDescription:
    """The actions of a launch, in order.

    Attributes:
        actions: The actions, kept as a tuple because they are read more than once.
        file: The launch file that it comes from, if any.

    Raises:
        LaunchError: One of them is not an action.
    """

    actions: Iterable[Action] = ()
    _: KW_ONLY
    file: str | None = None

    def __post_init__(self) -> None:
        given = cast("object", self.actions)  # launch files are seldom checked for types
        if not isinstance(given, Iterable):
            raise LaunchError(f"LaunchDescription: actions must be a list of them, not {excerpt(given)}")
        self.actions = tuple(self.actions)
        for each in self.actions:
            _check(each)

    def add_action(self, action: Action) -> None:
        """Add an action at the end.

        Args:
            action: The action.

        Raises:
            LaunchError: It is not an action.
        """
        _check(action)
        self.actions = (*self.actions, action)


def declared_arguments(actions: Iterable[Action]) -> list[DeclareLaunchArgument]:
    """Return the arguments that actions declare, also in groups, whatever their conditions."""
    found: dict[str, DeclareLaunchArgument] = {}
    for each in walk(actions):
        if isinstance(each, DeclareLaunchArgument):
            found.setdefault(each.name, each)
    return list(found.values())


def walk(actions: Iterable[Action]) -> Iterator[Action]:
    """Yield actions and the actions within them."""
    for each in actions:
        yield each
        yield from walk(getattr(each, "actions", ()))


def format_actions(actions: Iterable[Action], indent: str = "") -> Iterator[str]:
    """Yield lines that describe actions: a line for each, and the actions within it indented below."""
    for each in actions:
        yield f"{indent}{format_entity(each)}"
        yield from format_actions(getattr(each, "actions", ()), f"{indent}    ")


def _check(action: Any) -> None:
    # Launch files are seldom checked for types.
    if not isinstance(action, Action):
        raise LaunchError(f"A launch description has actions in it, such as Node(…), not {excerpt(action)}")
