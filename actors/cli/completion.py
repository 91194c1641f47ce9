"""Completion of command lines: verbs and options from the parsers, names from the broker.

The shells' scripts (`completions/`) run this at every press of Tab. It imports little, waits for a broker
only briefly, and hides all errors.
"""

from __future__ import annotations

import argparse
import shlex
from pathlib import Path
from typing import TYPE_CHECKING, Final, NamedTuple

from actors.cli.interrupts import raise_at_once
from actors.cli.parsing import parser_of
from actors.cli.table import ALIASES, VERBS, Verb, find_verb
from proto.errors import CallboardError
from proto.untrusted_text import sanitize
from proto.wire.codes import EntryKind
from proto.wire.names import is_hidden

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from actors.config.contexts import BrokerTarget
    from actors.graph.inspector import Inspector
    from actors.graph.snapshot import GraphSnapshot, NamesAndTypes

BROKER_TIMEOUT_SEC: Final = 0.3
"""A missing broker must not delay the user who presses Tab."""
PARAMETERS_TIMEOUT_SEC: Final = 0.6
"""The same for a node that does not answer; the time to connect included."""

TOPIC_KINDS: Final = (EntryKind.PUBLISHER, EntryKind.SUBSCRIPTION)
SERVICE_KINDS: Final = (EntryKind.SERVICE, EntryKind.CLIENT)


class Offer(NamedTuple):
    """A candidate for the next word, and its description."""

    word: str
    about: str = ""


FILES: Final = Offer(":files:")
"""Asks the shell to complete names of files."""


def run(options: argparse.Namespace) -> int:
    """Print a shell's script or, for the script, the candidates: a word and its description per line."""
    words: list[str] | None = options.words
    line: str | None = options.line
    if line is not None:
        words = split_line(line)
    if words is None:
        print(script(options.shell), end="")
        return 0
    raise_at_once()
    for offer in offers(words or [""]):
        about = offer.about.replace("\t", " ").replace("\n", " ")
        print(sanitize(f"{offer.word}\t{about}" if about else offer.word))
    return 0


def script(shell: str) -> str:
    """Return the script with which a shell completes command lines; it runs this module."""
    from importlib.resources import files  # noqa: PLC0415 - not while completing

    return (files("actors.cli") / "completions" / f"callboard.{shell}").read_text(encoding="utf-8")


def split_line(line: str) -> list[str]:
    """Return the words after the command's name; the last one is being typed, and may be empty."""
    for closing in ("", "'", '"'):
        try:
            words = shlex.split(line + closing)
        except ValueError:
            continue
        return words[1:] + ([""] if not closing and line[-1:].isspace() else [])
    return [""]


def offers(words: list[str]) -> list[Offer]:
    """Return the candidates for the last word, which may be incomplete."""
    *before, begun = words
    try:
        found = list(_offers(before, begun))
    except (CallboardError, OSError):  # running the command reports it
        return []
    return [offer for offer in found if offer is FILES or offer.word.startswith(begun)]


def _offers(before: list[str], begun: str) -> Iterator[Offer]:
    if not before:
        yield from (Offer(name, entry.summary) for name, entry in VERBS.items())
        yield from (Offer("--help", "print what there is"), Offer("--version", "print the version"))
        return
    before = [ALIASES.get(before[0], before[0]), *before[1:]]
    entry = VERBS.get(before[0])
    if entry is not None and len(before) == 1:
        yield from (Offer(name, verb.summary) for name, verb in entry.verbs.items())
    verb, words = find_verb(before)
    if verb is not None:
        yield from _Line(" ".join(before[:words]), verb, before[words:], begun).offers()


class _Line:
    """A partly typed command line.

    Args:
        command: The verb, such as "topic echo".
        verb: Its entry in the table.
        typed: The complete words after it.
        begun: The word that is being typed.
    """

    def __init__(self, command: str, verb: Verb, typed: list[str], begun: str) -> None:
        self.command = command
        self.begun = begun
        parser = parser_of(command, verb)
        actions = parser._actions  # noqa: SLF001 - argparse has no public access
        self._options = {text: action for action in actions for text in action.option_strings}
        self._positionals = [action for action in actions if not action.option_strings]
        self.values: dict[str, list[str]] = {}
        self._awaits: argparse.Action | None = None
        for word in typed:
            self._assign(word)

    def _assign(self, word: str) -> None:
        """Assign a complete word to its argument."""
        name, equals, value = word.partition("=")
        if self._awaits is not None and _takes_value(self._awaits):
            self._keep(self._awaits, word)
            self._awaits = None
        elif name in self._options and self.program is None:
            action = self._options[name]
            self._keep(action, *([value] if equals else []))
            self._awaits = None if equals else action
        else:
            positional = self._positional()
            if positional is not None:
                self._keep(positional, word)
            self._awaits = None

    def _keep(self, action: argparse.Action, *values: str) -> None:
        self.values.setdefault(action.dest, []).extend(values)

    @property
    def program(self) -> list[str] | None:
        """The program that `run` runs; all words after it belong to the program."""
        return self.values.get("program")

    def _positional(self) -> argparse.Action | None:
        """Return the next positional argument."""
        for action in self._positionals:
            many = action.nargs in {"*", "+", "...", argparse.REMAINDER}
            if many or action.dest not in self.values:
                return action
        return None

    def offers(self) -> Iterator[Offer]:
        """Yield the candidates for the next word."""
        name, equals, value = self.begun.partition("=")
        if self._awaits is not None and _takes_value(self._awaits):
            yield from self._values(self._awaits)
        elif equals and name in self._options:
            self.begun = value
            for offer in self._values(self._options[name]):
                yield offer if offer is FILES else Offer(f"{name}={offer.word}", offer.about)
        elif self.begun.startswith("-") and self.program is None:
            yield from self._unused_options()
        else:
            action = self._positional()
            if action is not None:
                yield from self._values(action)

    def _unused_options(self) -> Iterator[Offer]:
        for text, action in self._options.items():
            if action.help != argparse.SUPPRESS and (action.dest not in self.values or _repeats(action)):
                yield Offer(text, (action.help or "").replace("%%", "%"))

    def _values(self, action: argparse.Action) -> Iterator[Offer]:
        """Yield the candidates for an argument's value."""
        if action.choices is not None:
            yield from (Offer(str(choice)) for choice in action.choices)
            return
        find = _FINDERS.get(action.dest)
        if find is None and not action.option_strings:
            find = _FINDERS.get(str(action.metavar).lower())
        if find is not None:
            yield from find(self)
        elif action.metavar in {"FILE", "DIR", "SCRIPT"}:
            yield FILES

    def value_of(self, option: str) -> str | None:
        """Return the first value of an option or argument; None if it has none."""
        return next(iter(self.values.get(option, ())), None)


def _target(line: _Line) -> BrokerTarget:
    """Return the broker that the line chooses.

    Raises:
        CallboardError: There is no such context.
    """
    from actors.config.contexts import find_broker_target  # noqa: PLC0415

    domain = line.value_of("domain")
    number = int(domain) if domain and domain.isdecimal() else None
    return find_broker_target(line.value_of("url"), number, line.value_of("context"))


def _inspector(line: _Line) -> Inspector:
    """Return an inspector of the broker that the line chooses; to enter it connects.

    Raises:
        CallboardError: There is no such context, or the URL or domain is invalid.
    """
    from actors.config.contexts import find_broker_target  # noqa: PLC0415
    from actors.graph.inspector import inspector_for  # noqa: PLC0415 - most words need no broker

    domain = line.value_of("domain")
    number = int(domain) if domain and domain.isdecimal() else None
    target = find_broker_target(line.value_of("url"), number, line.value_of("context"))
    return inspector_for(target, BROKER_TIMEOUT_SEC)


def _snapshot(line: _Line) -> GraphSnapshot:
    """Return the graph of the broker that the line chooses.

    Raises:
        CallboardError: As `_inspector`, or it does not answer at once.
    """
    with _inspector(line) as inspector:
        return inspector.graph()


def _names_and_types(line: _Line, noun: str, *kinds: EntryKind) -> NamesAndTypes:
    from actors.graph.snapshot import actions_among  # noqa: PLC0415

    found = _snapshot(line).names_and_types(*kinds)
    return actions_among(found) if noun == "action" else found


def _names(line: _Line, noun: str, *kinds: EntryKind) -> Iterator[Offer]:
    """Yield topics, services or actions, each with its types."""
    for name, types in _names_and_types(line, noun, *kinds):
        yield from _named(line, name, ", ".join(types))


def _nodes(line: _Line) -> Iterator[Offer]:
    """Yield nodes."""
    for name in dict.fromkeys(_snapshot(line).nodes()):
        yield from _named(line, name, "")


def _brokers(line: _Line) -> Iterator[Offer]:
    """Yield the names of the brokers of a mesh, each with its id."""
    from proto.wire.mesh_keys import broker_id  # noqa: PLC0415

    with _inspector(line) as inspector:
        brokers = inspector.report().brokers.values()
    yield from (Offer(each.name, broker_id(each.number)) for each in brokers if each.name)


def _parameters(line: _Line) -> Iterator[Offer]:
    """Yield the parameters of the node on the line; of `param set`, names alternate with values."""
    from actors.cli.parameters import names_to_complete  # noqa: PLC0415 - the only words that need a node

    node = line.value_of("node")
    if node is None or len(line.values.get("pairs", ())) % 2:
        return
    target = _target(line)
    yield from map(Offer, names_to_complete(target, f"/{node.removeprefix('/')}", PARAMETERS_TIMEOUT_SEC))


def _named(line: _Line, name: str, about: str) -> Iterator[Offer]:
    """Yield a name, with its first slash as it was typed; a hidden one only if it was begun."""
    if not is_hidden(name) or "_" in line.begun:
        yield Offer(name if line.begun[:1] in {"", "/"} else name.removeprefix("/"), about)


def _types(line: _Line) -> Iterator[Offer]:
    """Yield the types of the topic, service or action on the line; all known ones if it has none."""
    from actors.interfaces.catalog import interfaces_of, known_packages  # noqa: PLC0415
    from actors.tools.prefixes import use_ros_interfaces  # noqa: PLC0415

    found = _declared_types(line)
    if found:
        yield from (Offer(each, "its type") for each in found)
        return
    kind = {"topic": "/msg/", "service": "/srv/", "action": "/action/"}.get(
        line.command.partition(" ")[0], "/"
    )
    use_ros_interfaces()
    for package in known_packages():
        yield from (Offer(each) for each in interfaces_of(package) if kind in each)


def _declared_types(line: _Line) -> list[str]:
    """Return the types that the topic, service or action on the line has now."""
    for dest, kinds in (("topic", TOPIC_KINDS), ("service", SERVICE_KINDS), ("action", SERVICE_KINDS)):
        name = line.value_of(dest)
        if name is not None:
            try:
                declared = dict(_names_and_types(line, dest, *kinds))
            except (CallboardError, OSError):
                return []
            return declared.get(f"/{name.removeprefix('/')}", [])
    return []


def _packages(line: _Line) -> Iterator[Offer]:
    """Yield packages: of types, or installed ones."""
    if line.command.startswith("interface"):
        from actors.interfaces.catalog import known_packages  # noqa: PLC0415
        from actors.tools.prefixes import use_ros_interfaces  # noqa: PLC0415

        use_ros_interfaces()
        yield from (Offer(each) for each in known_packages())
        return
    from actors.tools.executables import packages  # noqa: PLC0415

    yield from (Offer(each.name) for each in packages() if each.is_listed)


def _programs(line: _Line) -> Iterator[Offer]:
    """Yield what `run` can run: packages and scripts."""
    yield from _packages(line)
    yield FILES


def _executables(line: _Line) -> Iterator[Offer]:
    """Yield the programs of the package on the line, or files for a program's arguments."""
    from actors.tools.executables import find_package  # noqa: PLC0415

    program = (line.program or [""])[0]
    package = None if Path(program).is_file() else find_package(program)
    if package is not None and "arguments" not in line.values:
        yield from (Offer(each.name) for each in package.executables())
    else:
        yield FILES


def _transitions(_: _Line) -> Iterator[Offer]:
    """Yield the transitions that can be requested of a node."""
    from actors.lifecycle.states import REQUESTS  # noqa: PLC0415

    yield from (Offer(label) for label in dict.fromkeys(each.label for each in REQUESTS))


def _contexts(_: _Line) -> Iterator[Offer]:
    """Yield the named brokers."""
    from actors.config.contexts import Contexts  # noqa: PLC0415

    known = Contexts.load()
    yield from (Offer(name, known.get(name).url) for name in known.names())


_FINDERS: Final[dict[str, Callable[[_Line], Iterator[Offer]]]] = {
    "topic": lambda line: _names(line, "topic", *TOPIC_KINDS),
    "topics": lambda line: _names(line, "topic", *TOPIC_KINDS),
    "service": lambda line: _names(line, "service", *SERVICE_KINDS),
    "action": lambda line: _names(line, "action", *SERVICE_KINDS),
    "node": _nodes,
    "broker": _brokers,
    "parameter": _parameters,
    "parameters": _parameters,
    "pairs": _parameters,
    "transition": _transitions,
    "type": _types,
    "context": _contexts,
    "package": _packages,
    "program": _programs,
    "arguments": _executables,
}
"""By the name of an argument, the function that yields its values."""


def _takes_value(action: argparse.Action) -> bool:
    return action.nargs != 0


def _repeats(action: argparse.Action) -> bool:
    append = argparse._AppendAction  # noqa: SLF001 # pyright: ignore[reportPrivateUsage] - there is no other way
    return action.nargs in {"*", "+"} or isinstance(action, append)
