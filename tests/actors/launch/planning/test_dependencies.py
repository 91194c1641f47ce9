"""What a description means by something that must be there."""

from __future__ import annotations

from typing import Any

import pytest

from actors.launch.description.process_actions import Node
from actors.launch.description.substitutions import LaunchConfiguration
from actors.launch.errors import LaunchError
from actors.launch.planning.dependencies import MAX_KNOWN, KnownNodes, dependencies
from proto.errors import InvalidNameError
from tests.actors.launch.fake_library import scope

NAMED = Node(script="a.py", name="a")
UNNAMED = Node(script="b.py")
UNKNOWN = Node(script="c.py", name="c")


def meant(depends_on: Any, namespace: str | None = None) -> list[str]:
    """Return what is meant there, as text."""
    nodes = KnownNodes()
    nodes.add(NAMED, "/ns/a")
    nodes.add(UNNAMED, None)
    here = scope(launch_configurations={"robot": "r2"})
    return [str(each) for each in dependencies(depends_on, nodes, here, namespace)]


@pytest.mark.parametrize(
    ("depends_on", "namespace", "found"),
    [
        ((), None, []),
        ("service add", None, ["service /add"]),
        ("service add", "ns1", ["service /ns1/add"]),
        ("topic /add", "/ns1", ["topic /add"]),
        (["node  talker ", "topic a/b"], "/ns1/x", ["node /ns1/x/talker", "topic /ns1/x/a/b"]),
        ([["node ", LaunchConfiguration("robot")]], None, ["node /r2"]),
        (NAMED, "/elsewhere", ["node /ns/a"]),
        ([NAMED, "node /ns/a", "service a"], None, ["node /ns/a", "service /a"]),
    ],
)
def test_names_are_seen_from_the_namespace(depends_on: Any, namespace: str | None, found: list[str]) -> None:
    """A node of the description has its own; what is said twice is meant once."""
    assert meant(depends_on, namespace) == found


@pytest.mark.parametrize(
    ("depends_on", "error"),
    [
        ("add", "depends_on: 'add' must be 'node NAME', 'topic NAME', 'service NAME' or a Node"),
        (["servce add"], "'servce add' must be"),
        (UNNAMED, "Node 'b.py' is a dependency, and needs a name="),
        (UNKNOWN, "Node 'c' is a dependency, but is not started before that"),
        ([7], "Expected a string"),
    ],
)
def test_what_cannot_be_meant_is_an_error(depends_on: Any, error: str) -> None:
    """That says what can."""
    with pytest.raises(LaunchError) as caught:
        meant(depends_on)
    assert error in str(caught.value)


@pytest.mark.parametrize("text", ["service a b", "topic ", "node 1a", "topic a//b"])
def test_a_name_must_be_one(text: str) -> None:
    """What nothing can be called is not waited for."""
    with pytest.raises(InvalidNameError):
        meant(text)


def test_few_nodes_are_remembered() -> None:
    """The oldest are forgotten, so that a launch that makes nodes for ever keeps few."""
    nodes = KnownNodes()
    nodes.add(NAMED, "/a")
    for _ in range(MAX_KNOWN):
        nodes.add(Node(script="x.py"), "/x")
    with pytest.raises(LaunchError, match="not started before"):
        nodes.presence(NAMED)
