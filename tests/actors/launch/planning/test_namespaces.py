"""Namespaces within namespaces."""

from __future__ import annotations

import pytest

from actors.launch.planning.namespaces import absolute_namespace, prefix_namespace


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
    """An absolute one stands for itself; slashes at the end count for nothing."""
    assert prefix_namespace(base, namespace) == whole


@pytest.mark.parametrize(("namespace", "absolute"), [("", "/"), ("asd", "/asd"), ("/asd", "/asd")])
def test_a_namespace_becomes_absolute(namespace: str, absolute: str) -> None:
    """The empty one is the root."""
    assert absolute_namespace(namespace) == absolute
