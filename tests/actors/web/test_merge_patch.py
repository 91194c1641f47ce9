"""A patch turns one document into the other (RFC 7396)."""

from __future__ import annotations

from typing import Any

from hypothesis import given
from hypothesis import strategies as st

from actors.web.merge_patch import merge_patch

LEAVES = st.none() | st.booleans() | st.integers() | st.text(max_size=3) | st.lists(st.integers(), max_size=3)
DOCUMENTS = st.recursive(
    st.dictionaries(st.sampled_from("abc"), LEAVES, max_size=3),
    lambda inner: st.dictionaries(st.sampled_from("abc"), inner | LEAVES, max_size=3),
    max_leaves=12,
)


def applied(target: Any, patch: Any) -> Any:
    """Return the target with the patch, as RFC 7396 writes it down."""
    if not isinstance(patch, dict):
        return patch
    found = dict(target) if isinstance(target, dict) else {}
    for key, value in patch.items():
        if value is None:
            found.pop(key, None)
        else:
            found[key] = applied(found.get(key), value)
    return found


def without_none(value: Any) -> Any:
    """Return a document as a patch can convey it."""
    if not isinstance(value, dict):
        return value
    return {key: without_none(each) for key, each in value.items() if each is not None}


@given(DOCUMENTS, DOCUMENTS)
def test_a_patch_makes_the_new_document_of_the_old_one(old: dict[str, Any], new: dict[str, Any]) -> None:
    """Members that are None count as absent."""
    assert applied(without_none(old), merge_patch(old, new)) == without_none(new)


@given(DOCUMENTS)
def test_equal_documents_have_an_empty_patch(document: dict[str, Any]) -> None:
    """Nothing is sent if nothing has changed."""
    assert merge_patch(document, document) == {}


def test_only_what_has_changed_is_in_a_patch() -> None:
    """Neighbours of a changed member are left out."""
    old = {"a": {"x": 1, "y": 2}, "b": [1], "c": 3}
    new = {"a": {"x": 1, "y": 5}, "b": [1]}
    assert merge_patch(old, new) == {"a": {"y": 5}, "c": None}
