"""Names of nodes, topics and services, and the rules that remap them."""

from __future__ import annotations

from rclpy.expand_topic_name import expand_topic_name
from rclpy.topic_or_service_is_hidden import topic_or_service_is_hidden
from rclpy.validate_full_topic_name import validate_full_topic_name
from rclpy.validate_namespace import validate_namespace
from rclpy.validate_node_name import validate_node_name
from rclpy.validate_parameter_name import validate_parameter_name
from rclpy.validate_topic_name import validate_topic_name
from std_msgs.msg import String
from std_srvs.srv import Empty

from tests.real_ros.programs.errors import outcome
from tests.real_ros.programs.running import running_node

NAMES = (
    "a", "_a", "a1", "1a", "a/b", "/a", "~", "~/a", "a~", "/", "", "a//b", "a/", "a b", "a-b", "é", "{node}",
    "/{ns}/a", "{node}/a", "{x}", "{node", "/a/1b", "a" * 255, "a" * 256, "a__b", "_", "a/_b", "a.b", "/~/a",
    "~/{node}", "//a"
)  # fmt: skip


def _each(function, *args):
    return {name: outcome(function, name, *args) for name in NAMES}


def topic_names():
    """Check names of topics before they are expanded."""
    return _each(validate_topic_name)


def full_topic_names():
    """Check full names of topics."""
    return _each(validate_full_topic_name)


def namespaces():
    """Check namespaces."""
    return _each(validate_namespace)


def node_names():
    """Check names of nodes."""
    return _each(validate_node_name)


def parameter_names():
    """Check names of parameters."""
    return _each(validate_parameter_name)


def expanded():
    """Expand names of topics for a node in a namespace, and for one in none."""
    return [_each(expand_topic_name, "probe", "/ns"), _each(expand_topic_name, "probe", "/")]


def hidden():
    """Say which names are hidden."""
    return _each(topic_or_service_is_hidden)


def resolved():
    """Resolve names of topics and services with a node's namespace."""
    with running_node(namespace="ns") as node:
        names = [name for name in NAMES if outcome(validate_topic_name, name) is True]
        names = [
            name
            for name in names
            if len(name) < 255 and not name.startswith(("//", "/{ns}")) and name != "a//b"
        ]
        return [(name, node.resolve_topic_name(name), node.resolve_service_name(name)) for name in names]


def resolved_wrong():
    """Resolve what is no name."""
    with running_node(namespace="/ns") as node:
        return [outcome(node.resolve_topic_name, "a b"), outcome(node.resolve_service_name, "{x}")]


def tilde_without_slash():
    """Use a tilde in front of a name without a slash."""
    return [outcome(validate_topic_name, "~a"), outcome(expand_topic_name, "~a", "probe", "/")]


def nodes():
    """Make nodes of names and namespaces."""

    def make(name, namespace):
        with running_node(name=name, namespace=namespace) as node:
            return [node.get_name(), node.get_namespace(), node.get_fully_qualified_name()]

    pairs = [(name, "") for name in NAMES] + [("probe", name) for name in NAMES]
    return [outcome(make, *pair) for pair in pairs]


def remapped():
    """Remap topics by rules of all forms."""
    rules = (
        "a:=b", "/a:=b", "a:=/b", "~/a:=b", "/ns/a:=c", "probe:a:=d", "other:a:=d", "rostopic://a:=e",
        "rosservice://a:=f"
    )  # fmt: skip
    rules += (
        "a:=~/b",
        "a:=b/c",
        "/ns/probe/a:=g",
        "a:=a",
        "a:=",
        ":=b",
        "a:=b:=c",
        "a b:=c",
        "a:=1",
    )
    rules += (
        "__ns:=/other",
        "__node:=renamed",
        "__ns:=other",
        "__node:=a/b",
        "probe:__node:=x",
        "a:=https://x",
        "/*:=b",
        "/**:=b",
    )

    def resolve(rule):
        with running_node("-r", rule, namespace="/ns") as node:
            topics = [node.resolve_topic_name(name) for name in ("a", "/a", "~/a", "/ns/a", "b")]
            return [node.get_fully_qualified_name(), topics, node.resolve_service_name("a")]

    return {rule: outcome(resolve, rule) for rule in rules}


def remapped_substitution():
    """Remap a topic by a rule with a substitution."""

    def resolve(rule):
        with running_node("-r", rule, namespace="/ns") as node:
            return node.resolve_topic_name("probe")

    return [outcome(resolve, "{node}:=x"), outcome(resolve, "probe:={node}")]


def first_rule_counts():
    """Give two rules for one topic."""
    with running_node("-r", "a:=b", "-r", "a:=c", "-r", "b:=d") as node:
        return [node.resolve_topic_name("a"), node.resolve_topic_name("b")]


def endpoints():
    """Make endpoints of relative and private names with rules."""
    with running_node("-r", "chatter:=talk", "-r", "__ns:=/robot", "-r", "~/stop:=/halt") as node:
        publisher = node.create_publisher(String, "chatter", 1)
        subscription = node.create_subscription(String, "~/chatter", print, 1)
        service = node.create_service(Empty, "~/stop", print)
        client = node.create_client(Empty, "stop")
        return [publisher.topic_name, subscription.topic_name, service.srv_name, client.srv_name]


def wrong_endpoints():
    """Make endpoints of names that are none."""
    with running_node() as node:
        return {
            name: [
                outcome(lambda: node.create_publisher(String, name, 1).topic_name),  # noqa: B023
                outcome(lambda: node.create_client(Empty, name).srv_name),  # noqa: B023
            ]
            for name in ("a b", "", "/", "a//b", "~", "{x}", "1a", "/a/")
        }
