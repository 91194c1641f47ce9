"""Differences between documents as JSON Merge Patches (RFC 7396)."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, TypeAlias

if TYPE_CHECKING:
    from collections.abc import Mapping

Document: TypeAlias = "Mapping[str, Any]"


def merge_patch(old: Document, new: Document) -> dict[str, Any]:
    """Return the patch that turns one document into another.

    A member that is None counts as absent, since null deletes in a patch. Only maps are compared in depth:
    another list, number or text replaces the old one.

    Args:
        old: The document of the other side.
        new: The document that it should have.

    Returns:
        The patch; empty if there is no difference.
    """
    patch: dict[str, Any] = {
        key: None for key, value in old.items() if value is not None and new.get(key) is None
    }
    for key, value in new.items():
        before = old.get(key)
        if value is None or value == before:
            continue
        if isinstance(value, dict) and isinstance(before, dict):
            patch[key] = merge_patch(before, value)  # pyright: ignore[reportUnknownArgumentType]
        else:
            patch[key] = value
    return patch
