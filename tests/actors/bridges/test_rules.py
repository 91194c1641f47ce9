"""What may cross a bridge, and under which names."""

from __future__ import annotations

import pytest

from actors.bridges.errors import InvalidBridgeOptionError
from actors.bridges.rules import MAX_DECISIONS, MAX_PATTERNS, Rules, action_of, parse_depth


def test_without_rules_everything_crosses_under_its_name() -> None:
    """The default rules allow all names and change none."""
    rules = Rules()
    assert rules.crosses("/a/b")
    assert rules.name_here("/a") == rules.name_there("/a") == rules.node_here("/a") == rules.node_there("/a")
    assert rules.depth_of("/a") is None


@pytest.mark.parametrize(
    ("name", "crosses"),
    [
        ("/camera", True),
        ("/camera/image", True),
        ("/camera/left/image", True),
        ("/camera/raw", False),
        ("/cameras/image", False),
        ("/arm/joint", True),
        ("/arm/joint/state", False),
        ("/dock/_action/send_goal", True),
        ("/dock/_action/feedback", True),
        ("/undock/_action/feedback", False),
    ],
)
def test_patterns(name: str, *, crosses: bool) -> None:
    """`*` is one part, `**` any number, deny wins, and an action's name stands for what is below it."""
    rules = Rules(
        allow=("/camera/**", "/arm/*", "/dock", "/undock"), deny=("/camera/raw", "/undock"), depths=()
    )
    assert rules.crosses(name) is crosses
    assert rules.crosses(name) is crosses


def test_decisions_that_are_kept_are_limited() -> None:
    """A network with ever new names cannot fill the memory: answers stay right after the limit."""
    rules = Rules(deny=("/x/*",))
    for index in range(MAX_DECISIONS + 10):
        rules.crosses(f"/n{index}")
    assert not rules.crosses("/x/y")
    assert rules.crosses("/n1")


@pytest.mark.parametrize("namespace", ["/robot1", "robot1", "/robot1/"])
def test_namespace(namespace: str) -> None:
    """A namespace is put before the names of the other network, and taken from those below it."""
    rules = Rules(namespace=namespace)
    assert rules.name_here("/odom") == "/robot1/odom"
    assert rules.name_there("/robot1/odom") == "/odom"
    assert rules.name_there("/robot10/odom") is None
    assert rules.name_there("/robot1") is None
    assert rules.node_here("/base") == "/robot1/base"
    assert rules.node_there("/robot1/base") == "/base"
    assert rules.node_there("/ui") == "/ui"


def test_topics_of_all_nodes_have_no_namespace() -> None:
    """/rosout and /parameter_events have one name on both sides, and no second one in callboard."""
    rules = Rules(namespace="/robot1")
    for name in ("/rosout", "/parameter_events"):
        assert rules.name_here(name) == rules.name_there(name) == name
        assert rules.name_there(f"/robot1{name}") is None
    assert rules.name_here("/clock") == "/robot1/clock"


def test_the_first_depth_that_matches_decides() -> None:
    """Depths are looked up in their order."""
    rules = Rules(depths=(("/camera/raw", 1), ("/camera/**", 5)))
    assert rules.depth_of("/camera/raw") == 1
    assert rules.depth_of("/camera/small") == 5
    assert rules.depth_of("/scan") is None


@pytest.mark.parametrize(
    "pattern", ["", "/", "camera", "/camera/", "/a//b", "/a/b*", "/1/x", "/a b", "/***", "x/*"]
)
def test_what_is_no_pattern(pattern: str) -> None:
    """A wrong pattern is refused with the list that has it, and an example."""
    with pytest.raises(InvalidBridgeOptionError, match=r"deny: .* is not a pattern: .*/camera/image"):
        Rules(deny=(pattern,))


def test_wrong_depths_namespaces_and_long_lists() -> None:
    """Each wrong value is refused with its name."""
    for depth in (0, -1, 10**9, True):
        with pytest.raises(
            InvalidBridgeOptionError, match="depths: the depth of /a must be an integer from 1 to"
        ):
            Rules(depths=(("/a", depth),))
    with pytest.raises(InvalidBridgeOptionError, match="namespace: "):
        Rules(namespace="/ro bot")
    with pytest.raises(InvalidBridgeOptionError, match=f"allow: at most {MAX_PATTERNS} patterns"):
        Rules(allow=("/a",) * (MAX_PATTERNS + 1))
    with pytest.raises(InvalidBridgeOptionError, match="max_nodes must be an integer from 1 to 10000, not 0"):
        Rules(max_nodes=0)
    with pytest.raises(InvalidBridgeOptionError, match="max_endpoints must be an integer from 1 to 20000"):
        Rules(max_endpoints=20_001)


def test_depths_of_the_command_line() -> None:
    """A depth is written behind its pattern."""
    assert parse_depth("/camera/**=1") == ("/camera/**", 1)
    for wrong in ("", "/camera", "=1", "/camera=", "/camera=x", "/camera=-1", "/camera=99999999"):
        with pytest.raises(
            InvalidBridgeOptionError, match=r"expected a pattern and a depth, such as /camera"
        ):
            parse_depth(wrong)


def test_names_of_actions() -> None:
    """The endpoints of an action are below its name."""
    assert action_of("/a/b/_action/status") == "/a/b"
    assert not action_of("/a/b_action/status")
