"""Namespaces within namespaces."""

from __future__ import annotations

import pytest

from actors.launch.planning.namespaces import prefix_namespace


@pytest.mark.parametrize(
    ("base", "namespace", "whole"),
    [
        ("asd", "bsd", "asd/bsd"),
        ("asd", "/bsd", "/bsd"),
        ("/", "bsd", "/bsd"),
        ("asd", "", "asd"),
        ("asd", "bsd/", "asd/bsd"),
        ("/asd/", None, "/asd"),
        (None, "bsd", "bsd"),
        (None, "/", "/"),
        (None, None, None),
    ],
)
def test_namespaces_are_joined(base: str | None, namespace: str | None, whole: str | None) -> None:
    """An absolute one stays unchanged; slashes at the end are ignored."""
    assert prefix_namespace(base, namespace) == whole
