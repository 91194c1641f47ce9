"""Texts of substitutions, for functions of launch files."""

from __future__ import annotations

from pathlib import PurePath
from typing import TYPE_CHECKING

from actors.launch.description.substitutions import Substitution, TextSubstitution, resolve

if TYPE_CHECKING:
    from collections.abc import Iterable

    from actors.launch.description.substitutions import Scope, Text


def perform_substitutions(context: Scope, substitutions: Iterable[Substitution]) -> str:
    """Return the text that substitutions have in a context.

    Raises:
        LaunchError: One has no value there.
    """
    return resolve(list(substitutions), context)


def normalize_to_list_of_substitutions(subs: Text) -> list[Substitution]:
    """Return a text as a list of substitutions."""
    if isinstance(subs, Substitution):
        return [subs]
    if isinstance(subs, str | PurePath):
        return [TextSubstitution(str(subs))]
    return [each for piece in subs for each in normalize_to_list_of_substitutions(piece)]
