"""What `callboard` can do: each verb's name and what it does, without importing any of them."""

from __future__ import annotations

from importlib import import_module
from typing import Any, Final, NamedTuple


class Verb(NamedTuple):
    """What a verb does."""

    summary: str
    stays: bool = False
    """Runs until it is stopped, so that being stopped is no failure; sets up its own log."""


class Group(NamedTuple):
    """Verbs about one thing, said behind its name: `callboard topic list`."""

    summary: str
    verbs: dict[str, Verb]


VERBS: Final[dict[str, Verb | Group]] = {
    "broker": Verb("run the broker that nodes meet at", stays=True),
    "demo": Verb("see five nodes talk, in this terminal", stays=True),
    "run": Verb("run a script, or an installed program", stays=True),
    "launch": Verb("run the nodes that a launch file describes", stays=True),
    "topic": Group(
        "look at topics, hear them, publish on them",
        {
            "list": Verb("list topics"),
            "info": Verb("say who publishes and subscribes to a topic"),
            "type": Verb("print the type of a topic"),
            "find": Verb("list the topics of a type"),
            "echo": Verb("print the messages of a topic"),
            "pub": Verb("publish on a topic"),
            "hz": Verb("print how often messages come"),
            "bw": Verb("print how many bytes come"),
            "delay": Verb("print how old messages are when they come"),
        },
    ),
    "service": Group(
        "look at services and call them",
        {
            "list": Verb("list services"),
            "info": Verb("say who serves and calls a service"),
            "type": Verb("print the type of a service"),
            "find": Verb("list the services of a type"),
            "call": Verb("call a service"),
            "echo": Verb("print what becomes of a service's calls"),
        },
    ),
    "node": Group(
        "list nodes, and say what they have",
        {
            "list": Verb("list nodes"),
            "info": Verb("say what a node publishes, subscribes to, serves and calls"),
        },
    ),
    "interface": Group(
        "show message types, generate their classes",
        {
            "show": Verb("print the definition of a type"),
            "proto": Verb("print a message to fill in"),
            "list": Verb("list all types"),
            "package": Verb("list the types of a package"),
            "packages": Verb("list the packages that have types"),
            "generate": Verb("write Python classes for a package of .msg, .srv and .action files"),
        },
    ),
    "pkg": Group(
        "make packages of nodes, list what is installed",
        {
            "create": Verb("make a new package of nodes"),
            "list": Verb("list installed packages that use callboard"),
            "executables": Verb("list the programs of packages"),
            "prefix": Verb("print where a package is installed"),
        },
    ),
    "context": Group(
        "name brokers, and choose the one to go to",
        {
            "list": Verb("list the named brokers"),
            "show": Verb("say where commands and nodes go, and why"),
            "use": Verb("go to a broker from now on"),
            "add": Verb("give a broker a name"),
            "remove": Verb("forget a named broker"),
        },
    ),
    "graph": Verb("draw who talks to whom"),
    "doctor": Verb("look whether everything is in order here and at the broker"),
    "top": Verb("see topics, nodes and services at work, live"),
    "completion": Verb("let a shell complete verbs, options and names"),
    "bench": Verb("measure how fast callboard is on this machine"),
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


def load(command: str) -> Any:
    """Import the module of a verb, such as "topic list"; see `actors.cli.commands`."""
    return import_module(f"actors.cli.commands.{command.replace(' ', '.')}")
