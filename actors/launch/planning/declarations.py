"""The arguments of a launch, declared in its file and in the files that it includes."""

from __future__ import annotations

from contextlib import suppress
from typing import TYPE_CHECKING, Final

from actors.launch.description.action import Setting
from actors.launch.description.actions import DeclareLaunchArgument, GroupAction, IncludeLaunchDescription
from actors.launch.description.description_source import included_context
from actors.launch.description.substitutions import resolve
from actors.launch.planning.settings import apply_setting
from proto.errors import CallboardError

if TYPE_CHECKING:
    from collections.abc import Iterable

    from actors.launch.description.action import Action
    from actors.launch.description.description_source import LaunchLibrary
    from actors.launch.description.substitutions import LaunchContext

MAX_INCLUDES: Final = 32
"""Depth of files that include each other."""

MAX_INCLUDED: Final = 2000
"""Includes of a launch in all. Files that include the next one twice would double with each level."""


def all_declared(
    actions: Iterable[Action], context: LaunchContext, library: LaunchLibrary
) -> list[DeclareLaunchArgument]:
    """Return the arguments that users can give, whatever the conditions of their declarations.

    Included files are searched if their paths are known without further arguments. An argument that an
    include sets is not an argument of the launch.

    Args:
        actions: The actions of the launch file.
        context: The context of the file; it is changed.
        library: Reads included launch files.
    """
    search = _Search(library)
    search.search(actions, context, frozenset())
    return list(search.found.values())


class _Search:
    """A search through files that include each other."""

    def __init__(self, library: LaunchLibrary) -> None:
        self._library = library
        self.found: dict[str, DeclareLaunchArgument] = {}
        self._seen: set[tuple[str | None, frozenset[str]]] = set()
        self._depth = 0

    def search(self, actions: Iterable[Action], context: LaunchContext, given: frozenset[str]) -> None:
        """Search actions; `given` are the arguments that the includes around them set."""
        for action in actions:
            # Errors, and values that are not known yet, are reported when the launch is planned.
            with suppress(CallboardError):
                self._search_action(action, context, given)

    def _search_action(self, action: Action, context: LaunchContext, given: frozenset[str]) -> None:
        match action:
            case DeclareLaunchArgument(name=name, default_value=default):
                if name not in given:
                    self.found.setdefault(name, action)
                # Defaults count: the path of an include often depends on one.
                if name not in context.launch_configurations and default is not None:
                    context.launch_configurations[name] = resolve(default, context)
            case Setting():
                apply_setting(action, context)
            case IncludeLaunchDescription():
                self._include(action, context, given)
            case _:
                # Also into groups and handlers whose conditions are false: another argument may make them
                # true.
                shared = isinstance(action, GroupAction) and not action.scoped
                self.search(getattr(action, "actions", ()), context if shared else context.inner(), given)

    def _include(
        self, action: IncludeLaunchDescription, context: LaunchContext, given: frozenset[str]
    ) -> None:
        inner = included_context(action, context)
        # With other arguments given, another part of the same file may be undeclared, so both are the key.
        given |= {name for name, _ in action.given}
        if inner.file is None or (inner.file, given) in self._seen or self._depth == MAX_INCLUDES:
            return
        if len(self._seen) == MAX_INCLUDED:  # an error where the launch is planned
            return
        self._seen.add((inner.file, given))
        # A file that includes itself with other arguments each time would otherwise be searched for ever.
        self._depth += 1
        try:
            self.search(self._library.description(inner.file).actions, inner, given)
        finally:
            self._depth -= 1
