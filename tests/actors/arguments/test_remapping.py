"""Remap rules: how they read, which one applies, and what a node's names become."""

from __future__ import annotations

import pytest

from actors.arguments.remapping import RemapKind, Remapper, RemapRule
from proto.errors import (
    InvalidNamespaceError,
    InvalidNodeNameError,
    InvalidServiceNameError,
    InvalidTopicNameError,
)


def rules(*texts: str) -> list[RemapRule]:
    return [RemapRule.parse(text) for text in texts]


@pytest.mark.parametrize(
    ("text", "rule"),
    [
        ("foo:=bar", RemapRule(kind=RemapKind.TOPIC_OR_SERVICE, match="foo", replacement="bar")),
        ("n:/a:=~/b", RemapRule(kind=RemapKind.TOPIC_OR_SERVICE, match="/a", replacement="~/b", node="n")),
        ("rostopic://foo:=bar", RemapRule(kind=RemapKind.TOPIC, match="foo", replacement="bar")),
        ("rosservice:///foo:=bar", RemapRule(kind=RemapKind.SERVICE, match="/foo", replacement="bar")),
        ("n:rostopic://a:=b", RemapRule(kind=RemapKind.TOPIC, match="a", replacement="b", node="n")),
        (
            "rostopic:=/foo/bar",
            RemapRule(kind=RemapKind.TOPIC_OR_SERVICE, match="rostopic", replacement="/foo/bar"),
        ),
        ("__node:=n", RemapRule(kind=RemapKind.NODE, replacement="n")),
        ("old:__name:=n", RemapRule(kind=RemapKind.NODE, replacement="n", node="old")),
        ("__ns:=/", RemapRule(kind=RemapKind.NAMESPACE, replacement="/")),
        ("_:=kq", RemapRule(kind=RemapKind.TOPIC_OR_SERVICE, match="_", replacement="kq")),
    ],
)
def test_reading_a_rule(text: str, rule: RemapRule) -> None:
    """Every form of a rule is read."""
    assert RemapRule.parse(text) == rule


@pytest.mark.parametrize(
    "text",
    [
        *(":", "1", "~", ":=", "foo:=", ":=bar", "__node:=", "__node:=/foo/bar", "__ns:=", "__ns:=foo"),
        *("f oo:=/bar", "foo:=/b}ar", "foo:=/b ar", "}foo:=/bar", "f{oo:=/bar", "", "foo"),
        *(":__node:=n", "~:__node:=n", "rostopic://:=x", "rostopic::=x", "a/b:foo:=bar"),
    ],
)
def test_rules_that_are_none(text: str) -> None:
    """What is no rule is a ValueError."""
    with pytest.raises(ValueError, match=r"expected from:=to|Invalid"):
        RemapRule.parse(text)


def test_both_sides_are_expanded() -> None:
    """The rule is compared after expansion in the node's namespace."""
    remapper = Remapper("node", "/ns", process_rules=rules("foo:=bar", "~/x:=/y", "/abs:={node}/z"))
    assert remapper.resolve_topic("foo") == "/ns/bar"
    assert remapper.resolve_topic("/ns/foo") == "/ns/bar"
    assert remapper.resolve_topic("/foo") == "/foo"
    assert remapper.resolve_topic("~/x") == "/y"
    assert remapper.resolve_topic("/abs") == "/ns/node/z"


def test_a_rule_has_one_direction() -> None:
    """The new name is not renamed back."""
    remapper = Remapper("node", process_rules=rules("/bar/foo:=/foo/bar"))
    assert remapper.resolve_topic("/bar/foo") == "/foo/bar"
    assert remapper.resolve_topic("/foo/bar") == "/foo/bar"


@pytest.mark.parametrize(
    ("texts", "name", "namespace"),
    [
        ([], "my_node", "/my_ns"),
        (["__ns:=/another_ns"], "my_node", "/another_ns"),
        (["__node:=another_node"], "another_node", "/my_ns"),
        (["__ns:=/another_ns", "__node:=another_node"], "another_node", "/another_ns"),
        (["other:__node:=x", "other:__ns:=/x"], "my_node", "/my_ns"),
        (["my_node:__node:=x", "x:__ns:=/x"], "x", "/x"),
        (["__node:=first", "__node:=second"], "first", "/my_ns"),
    ],
)
def test_node_and_namespace(texts: list[str], name: str, namespace: str) -> None:
    """The node's own names, also for one node only; the first rule wins."""
    remapper = Remapper("my_node", "/my_ns", process_rules=rules(*texts))
    assert (remapper.name, remapper.namespace) == (name, namespace)


def test_rules_for_one_node() -> None:
    """A prefixed rule applies to the node of that name only."""
    given = rules("Node1:/foo:=/x", "Node1:__ns:=/y")
    one, two = Remapper("Node1", process_rules=given), Remapper("Node2", process_rules=given)
    assert (one.namespace, one.resolve_topic("/foo")) == ("/y", "/x")
    assert (two.namespace, two.resolve_topic("/foo")) == ("/", "/foo")


def test_own_rules_win() -> None:
    """A node's own rules go before the process's, and those can be left out."""
    process = rules("foo:=process", "__ns:=/process", "bar:=also")
    both = Remapper("node", rules=rules("foo:=own", "__ns:=/own"), process_rules=process)
    assert both.namespace == "/own"
    assert both.resolve_topic("foo") == "/own/own"
    assert both.resolve_topic("bar") == "/own/also"
    alone = Remapper("node", "/ns")
    assert (alone.name, alone.namespace, alone.resolve_topic("foo")) == ("node", "/ns", "/ns/foo")


def test_first_rule_only() -> None:
    """The first matching rule is applied, once."""
    remapper = Remapper("node", process_rules=rules("a:=b", "a:=c", "b:=d"))
    assert remapper.resolve_topic("a") == "/b"
    assert remapper.resolve_topic("b") == "/d"


def test_topics_and_services() -> None:
    """A plain rule is for both, a scheme for one."""
    texts = ("rostopic://t:=t2", "rosservice://s:=s2", "service:=example/new_service")
    remapper = Remapper("node", "/ns", process_rules=rules(*texts))
    assert (remapper.resolve_topic("t"), remapper.resolve_service("t")) == ("/ns/t2", "/ns/t")
    assert (remapper.resolve_topic("s"), remapper.resolve_service("s")) == ("/ns/s", "/ns/s2")
    assert remapper.resolve_topic("service") == "/ns/example/new_service"
    assert remapper.resolve_service("service") == "/ns/example/new_service"


def test_prefix_is_the_new_node_name() -> None:
    """A prefixed topic rule is compared with the node's new name."""
    remapper = Remapper("old", process_rules=rules("__node:=new", "old:a:=no", "new:a:=yes"))
    assert remapper.resolve_topic("a") == "/yes"


def test_only_expand() -> None:
    """Expansion without remapping can be asked for."""
    remapper = Remapper("node", "/my_ns", process_rules=rules("foo:=bar"))
    assert remapper.resolve_topic("foo") == "/my_ns/bar"
    assert remapper.resolve_topic("foo", only_expand=True) == "/my_ns/foo"
    assert remapper.resolve_service("foo", only_expand=True) == "/my_ns/foo"
    assert remapper.resolve_topic("/abs") == "/abs"


def test_invalid_names() -> None:
    """Each wrong name raises the error of its kind."""
    with pytest.raises(InvalidNodeNameError):
        Remapper("no/de")
    with pytest.raises(InvalidNamespaceError):
        Remapper("node", "ns")
    with pytest.raises(InvalidTopicNameError):
        Remapper("node").resolve_topic("a//b")
    with pytest.raises(InvalidServiceNameError):
        Remapper("node").resolve_service("a b")
    with pytest.raises(InvalidTopicNameError, match="unknown substitution"):
        Remapper("node", process_rules=rules("a:={b}"))
