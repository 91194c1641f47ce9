"""What `callboard` can do: each verb's name, its module and what it does, without importing any of them.

A verb's module has `add_arguments(parser)`, `EXAMPLES` (command lines, shown by `--help`, each with what it
does) and `run(options) -> int`. Its top level imports only what reading arguments needs.
"""

from __future__ import annotations

from typing import Final, NamedTuple


class Verb(NamedTuple):
    """A verb: where its code is, and what it does."""

    module: str
    summary: str
    stays: bool = False
    """Runs until it is stopped, so that being stopped is no failure; sets up its own log."""


class Group(NamedTuple):
    """Verbs about one thing, said behind its name: `callboard topic list`."""

    summary: str
    verbs: dict[str, Verb]


VERBS: Final[dict[str, Verb | Group]] = {
    "broker": Verb("actors.cli.broker", "run the broker that nodes meet at", stays=True),
    "demo": Verb("actors.cli.demo", "see five nodes talk, in this terminal", stays=True),
    "run": Verb("actors.cli.run", "run a script, or an installed program", stays=True),
    "launch": Verb("actors.cli.verbs.launch", "run the nodes that a launch file describes", stays=True),
    "topic": Group(
        "look at topics, hear them, publish on them",
        {
            "list": Verb("actors.cli.verbs.topic_list", "list topics"),
            "info": Verb("actors.cli.verbs.topic_info", "say who publishes and subscribes to a topic"),
            "type": Verb("actors.cli.verbs.topic_type", "print the type of a topic"),
            "find": Verb("actors.cli.verbs.topic_find", "list the topics of a type"),
            "echo": Verb("actors.cli.verbs.topic_echo", "print the messages of a topic"),
            "pub": Verb("actors.cli.verbs.topic_pub", "publish on a topic"),
            "hz": Verb("actors.cli.verbs.topic_hz", "print how often messages come"),
            "bw": Verb("actors.cli.verbs.topic_bw", "print how many bytes come"),
            "delay": Verb("actors.cli.verbs.topic_delay", "print how old messages are when they come"),
        },
    ),
    "service": Group(
        "look at services and call them",
        {
            "list": Verb("actors.cli.verbs.service_list", "list services"),
            "info": Verb("actors.cli.verbs.service_info", "say who serves and calls a service"),
            "type": Verb("actors.cli.verbs.service_type", "print the type of a service"),
            "find": Verb("actors.cli.verbs.service_find", "list the services of a type"),
            "call": Verb("actors.cli.verbs.service_call", "call a service"),
            "echo": Verb("actors.cli.verbs.service_echo", "print what becomes of a service's calls"),
        },
    ),
    "node": Group(
        "list nodes, and say what they have",
        {
            "list": Verb("actors.cli.verbs.node_list", "list nodes"),
            "info": Verb(
                "actors.cli.verbs.node_info", "say what a node publishes, subscribes to, serves and calls"
            ),
        },
    ),
    "interface": Group(
        "show message types, generate their classes",
        {
            "show": Verb("actors.cli.verbs.interface_show", "print the definition of a type"),
            "proto": Verb("actors.cli.verbs.interface_proto", "print a message to fill in"),
            "list": Verb("actors.cli.verbs.interface_list", "list all types"),
            "package": Verb("actors.cli.verbs.interface_package", "list the types of a package"),
            "packages": Verb("actors.cli.verbs.interface_packages", "list the packages that have types"),
            "generate": Verb(
                "actors.cli.verbs.interface_generate",
                "write Python classes for a package of .msg, .srv and .action files",
            ),
        },
    ),
    "pkg": Group(
        "make packages of nodes, list what is installed",
        {
            "create": Verb("actors.cli.verbs.pkg_create", "make a new package of nodes"),
            "list": Verb("actors.cli.verbs.pkg_list", "list installed packages that use callboard"),
            "executables": Verb("actors.cli.verbs.pkg_executables", "list the programs of packages"),
            "prefix": Verb("actors.cli.verbs.pkg_prefix", "print where a package is installed"),
        },
    ),
    "context": Group(
        "name brokers, and choose the one to go to",
        {
            "list": Verb("actors.cli.verbs.context_list", "list the named brokers"),
            "show": Verb("actors.cli.verbs.context_show", "say where commands and nodes go, and why"),
            "use": Verb("actors.cli.verbs.context_use", "go to a broker from now on"),
            "add": Verb("actors.cli.verbs.context_add", "give a broker a name"),
            "remove": Verb("actors.cli.verbs.context_remove", "forget a named broker"),
        },
    ),
    "graph": Verb("actors.cli.verbs.graph", "draw who talks to whom"),
    "doctor": Verb("actors.cli.verbs.doctor", "look whether everything is in order here and at the broker"),
    "top": Verb("actors.cli.verbs.top", "see topics, nodes and services at work, live"),
    "completion": Verb("actors.cli.verbs.completion", "let a shell complete verbs, options and names"),
    "bench": Verb("actors.cli.bench", "measure how fast callboard is on this machine"),
}


def each_verb() -> list[tuple[str, Verb]]:
    """Return every verb as it is typed, such as "topic list"."""
    found: list[tuple[str, Verb]] = []
    for name, entry in VERBS.items():
        if isinstance(entry, Verb):
            found.append((name, entry))
        else:
            found += [(f"{name} {verb}", each) for verb, each in entry.verbs.items()]
    return found
