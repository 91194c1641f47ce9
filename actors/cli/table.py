"""The verbs of `callboard` with their summaries; no verb is imported."""

from __future__ import annotations

from importlib import import_module
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Final, NamedTuple

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence


class Verb(NamedTuple):
    """A verb.

    Attributes:
        summary: What it does.
        stays: It runs until it is stopped, so that SIGINT and SIGTERM are no failure.
        verbs: Verbs that may follow it, which do something else: `callboard doctor hello`.
    """

    summary: str
    stays: bool = False
    verbs: Mapping[str, Verb] = MappingProxyType({})


class Group(NamedTuple):
    """Verbs behind a common word: `callboard topic list`."""

    summary: str
    verbs: dict[str, Verb]


VERBS: Final[dict[str, Verb | Group]] = {
    "broker": Verb("run the broker that nodes connect to", stays=True),
    "demo": Verb("run five example nodes, in this terminal", stays=True),
    "run": Verb("run a script, or an installed program", stays=True),
    "launch": Verb("run the nodes that a launch file describes", stays=True),
    "topic": Group(
        "list topics, print their messages, publish on them",
        {
            "list": Verb("list topics"),
            "info": Verb("print the publishers and subscriptions of a topic"),
            "type": Verb("print the type of a topic"),
            "find": Verb("list the topics of a type"),
            "echo": Verb("print the messages of a topic"),
            "pub": Verb("publish on a topic"),
            "hz": Verb("print the rate of messages"),
            "bw": Verb("print the bandwidth of messages"),
            "delay": Verb("print the age of messages on arrival"),
        },
    ),
    "service": Group(
        "list services and call them",
        {
            "list": Verb("list services"),
            "info": Verb("print the servers and clients of a service"),
            "type": Verb("print the type of a service"),
            "find": Verb("list the services of a type"),
            "call": Verb("call a service"),
            "echo": Verb("print the requests and responses of a service"),
        },
    ),
    "action": Group(
        "list actions, send goals to them",
        {
            "list": Verb("list actions"),
            "info": Verb("print the servers and clients of an action"),
            "type": Verb("print the type of an action"),
            "find": Verb("list the actions of a type"),
            "send_goal": Verb("send a goal, and print its result; exit with 1 unless it succeeds"),
            "echo": Verb("print the feedback and the states of an action's goals"),
        },
    ),
    "node": Group(
        "list nodes and their topics and services",
        {
            "list": Verb("list nodes"),
            "info": Verb("print the topics and services of a node"),
            "diagnostics": Verb("print where a node runs and what its callbacks take"),
        },
    ),
    "param": Group(
        "read and set the parameters of nodes",
        {
            "list": Verb("list the parameters of nodes"),
            "get": Verb("print the value of a parameter"),
            "set": Verb("set parameters"),
            "describe": Verb("print the type and constraints of parameters"),
            "delete": Verb("delete a parameter"),
            "dump": Verb("print all parameters of a node as a file"),
            "load": Verb("set the parameters that a file has for a node"),
        },
    ),
    "lifecycle": Group(
        "read and change the states of nodes",
        {
            "nodes": Verb("list nodes with states"),
            "get": Verb("print the state of nodes"),
            "list": Verb("print the transitions that are possible now"),
            "set": Verb("request a transition of a node"),
        },
    ),
    "log": Verb("print the log of all nodes"),
    "interface": Group(
        "show message types, generate their classes",
        {
            "show": Verb("print the definition of a type"),
            "proto": Verb("print a message to fill in"),
            "list": Verb("list all types"),
            "package": Verb("list the types of a package"),
            "packages": Verb("list the packages that have types"),
            "generate": Verb("write Python classes for a package of .msg, .srv, .action and .idl files"),
        },
    ),
    "pkg": Group(
        "make packages of nodes, list what is installed",
        {
            "create": Verb("make a new package of nodes"),
            "list": Verb("list installed packages that use callboard"),
            "executables": Verb("list the programs of packages"),
            "prefix": Verb("print where a package is installed"),
            "xml": Verb("print the manifest of a package of ROS 2"),
        },
    ),
    "context": Group(
        "name brokers, and choose the one to use",
        {
            "list": Verb("list the named brokers"),
            "show": Verb("print the broker that commands and nodes use, and why"),
            "use": Verb("use a broker from now on"),
            "add": Verb("give a broker a name"),
            "remove": Verb("forget a named broker"),
        },
    ),
    "auth": Group(
        "define who may connect to a broker, and explain what they may do",
        {
            "list": Verb("list the users"),
            "add": Verb("add a user, and print a new token"),
            "remove": Verb("remove a user"),
            "token": Verb("give a user a new token"),
            "check": Verb("say whether a user may do something, and why"),
        },
    ),
    "mesh": Group(
        "show the brokers that form one graph",
        {
            "list": Verb("list the brokers"),
            "info": Verb("print the traffic between brokers, and problems"),
        },
    ),
    "bag": Group(
        "record and play topics, inspect and convert recordings",
        {
            "record": Verb("record topics into a bag", stays=True),
            "play": Verb("publish the messages of a bag", stays=True),
            "burst": Verb("publish messages of a bag at once", stays=True),
            "info": Verb("print what is in a bag"),
            "echo": Verb("print the messages of a topic in a bag"),
            "check": Verb("read a whole bag, and say what is wrong"),
            "list": Verb("list the formats of bags"),
            "convert": Verb("convert bags into a new one: join, select, compress, or turn SQLite into MCAP"),
            "reindex": Verb("write the metadata.yaml of a bag again, from its files"),
            "recover": Verb("copy what can be read of a damaged bag into a new one"),
            "export": Verb("write the messages of a bag as tables, one per topic"),
        },
    ),
    "bridge": Group(
        "put the nodes of another network into the graph",
        {
            "ros2": Verb("show the nodes of callboard and of ROS 2 in one graph", stays=True),
            "info": Verb("print what crosses, and what does not, and why"),
        },
    ),
    "graph": Verb("draw the graph of nodes, topics and services"),
    "doctor": Verb(
        "check this machine, the broker and the graph",
        verbs={"hello": Verb("show whether messages of other hosts arrive")},
    ),
    "top": Verb("show topics, nodes and services, live"),
    "web": Verb("show and control the graph in a browser", stays=True),
    "foxglove": Verb("serve the graph to Foxglove and its relatives", stays=True),
    "rosbridge": Verb("serve the graph to roslib, roslibpy and other rosbridge clients", stays=True),
    "completion": Verb("print a shell script that completes verbs, options and names"),
    "bench": Verb("measure the performance of callboard on this machine"),
}


ALIASES: Final = {"wtf": "doctor"}
"""Other words for verbs, as in ROS 2."""

ELSEWHERE: Final = {
    "component": "there are no component containers; a launch file runs nodes in one process (`node=`)",
    "control": "there is no controller manager; `callboard service call` calls the services of a node",
    "daemon": "there is no daemon to start or stop; each command asks the broker (`callboard broker`)",
    "extension_points": "verbs are no plugins; `callboard --help` lists them",
    "extensions": "verbs are no plugins; `callboard --help` lists them",
    "multicast": "nothing uses multicast; `callboard doctor hello` shows whether messages of others arrive",
    "security": "there are no keystores; `callboard auth` says who may do what, and TLS encrypts",
    "test": "there are no launch tests of its own; callboard's plugin of pytest starts launch files",
    "trace": "there is no tracing; `callboard top` and `callboard node diagnostics` show what callbacks take",
}
"""Words of the `ros2` command that are no verbs here, and the sentence that says what to use instead."""


def find_verb(words: Sequence[str]) -> tuple[Verb | None, int]:
    """Return the verb that the first words name, and the number of these words."""
    entry = VERBS.get(words[0]) if words else None
    if isinstance(entry, Group):
        return (entry.verbs.get(words[1]) if len(words) > 1 else None), 2
    if entry is not None and len(words) > 1 and words[1] in entry.verbs:
        return entry.verbs[words[1]], 2
    return entry, 1


def each_verb() -> list[tuple[str, Verb]]:
    """Return every verb as it is typed, such as "topic list"."""
    found: list[tuple[str, Verb]] = []
    for name, entry in VERBS.items():
        if isinstance(entry, Verb):
            found.append((name, entry))
        found += [(f"{name} {verb}", each) for verb, each in entry.verbs.items()]
    return found


def load(command: str) -> Any:
    """Import the module of a verb, such as "topic list"; see `actors.cli.commands`."""
    return import_module(f"actors.cli.commands.{command.replace(' ', '.')}")
