"""Texts of substitutions, and checks of arguments, for launch files and actions of their own."""

from __future__ import annotations

from pathlib import PurePath
from typing import TYPE_CHECKING

from actors.launch.description.substitutions import Substitution, TextSubstitution, resolve

if TYPE_CHECKING:
    from collections.abc import Iterable

    from actors.launch.description.substitutions import LaunchContext, Text


def perform_substitutions(context: LaunchContext, substitutions: Iterable[Substitution]) -> str:
    """Return the text that substitutions have in a context.

    Raises:
        LaunchError: One has no value there.
    """
    return resolve(list(substitutions), context)


def normalize_to_list_of_substitutions(subs: Text) -> list[Substitution]:
    """Return a string as a list of substitutions."""
    if isinstance(subs, Substitution):
        return [subs]
    if isinstance(subs, str | PurePath):
        return [TextSubstitution(str(subs))]
    return [each for piece in subs for each in normalize_to_list_of_substitutions(piece)]


def is_a(obj: object, entity_type: type) -> bool:
    """Return whether an object is of a type."""
    return isinstance(obj, entity_type)


def is_a_subclass(obj: object, entity_type: type) -> bool:
    """Return whether an object, or the class that it is, is of a type."""
    return isinstance(obj, entity_type) or (isinstance(obj, type) and issubclass(obj, entity_type))


def ensure_argument_type(
    argument: object, types: type | Iterable[type], argument_name: str, caller: str | None = None
) -> None:
    """Check the type of an argument.

    Raises:
        TypeError: It is of none of the types.
    """
    wanted = (types,) if isinstance(types, type) else tuple(types)
    if not isinstance(argument, wanted):
        names = ", ".join(each.__name__ for each in wanted)
        where = f" of {caller}" if caller else ""
        raise TypeError(
            f"'{argument_name}'{where} must be of type {names}, not {type(argument).__name__}: {argument!r}"
        )
