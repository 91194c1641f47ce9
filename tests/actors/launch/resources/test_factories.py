"""Factories by name: what is found, and what is said of what is not."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

import pytest

import actors
from actors.launch.errors import LaunchError
from actors.launch.resources.files import Files

if TYPE_CHECKING:
    from tests.actors.site_packages import Site


def test_a_class_is_found() -> None:
    """By its module and its name there; also one within a class."""
    found: list[object] = [
        Files().factory("actors.node.node:Node"),
        Files().factory("actors.node.node:Node.get_name"),
    ]
    assert found == [actors.Node, actors.Node.get_name]


@pytest.mark.parametrize(
    ("name", "text"),
    [
        (
            "actors.node.node.Node",
            "'actors.node.node.Node' is not the name of a node: write it as node='package.module:Class'",
        ),
        (":Node", "':Node' is not the name of a node"),
        ("actors..node:Node", "is not the name of a node"),
        ("actors.node.node:", "is not the name of a node"),
        ("actors.node.node:Noddy", "Module 'actors.node.node' has no 'Noddy'"),
        ("actors.node.node:Node.x.y", "Module 'actors.node.node' has no 'Node.x.y'"),
        ("no_such_module:Node", "Module 'no_such_module' cannot be imported: ModuleNotFoundError: No module"),
        (
            "actors.node.node:__name__",
            "actors.node.node:__name__ is neither a class nor a function, but 'actors.node.node'",
        ),
    ],
)
def test_what_is_wrong_is_reported(name: str, text: str) -> None:
    """In one line."""
    with pytest.raises(LaunchError, match=re.escape(text)):
        Files().factory(name)


def test_a_module_that_fails_is_no_factory(site: Site) -> None:
    """Whatever it raises."""
    (site.path / "failing_at_import.py").write_text("raise ValueError('bad\\x1b[2J')")
    with pytest.raises(LaunchError, match=r"cannot be imported: ValueError: bad\\x1b\[2J"):
        Files().factory("failing_at_import:Node")
