"""`list`, `info`, `type` and `find` for topics, services and actions."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final, NamedTuple

from actors.cli.parsing import Options, Parser, add_broker_options, add_json_option, add_ros_options
from proto.wire.codes import EntryKind
from proto.wire.names import is_hidden, validate_full_service_name, validate_full_topic_name

# Reading arguments needs nothing else.
# ruff: noqa: PLC0415

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence

    from actors.cli.errors import CommandError
    from actors.cli.tables import Styled
    from actors.graph.snapshot import EndpointInfo, GraphSnapshot, NamesAndTypes
    from actors.tools.broker_names import BrokerNames
    from actors.tools.graph_drawing.mismatches import Mismatch
    from proto.wire.stats import TopicStats


class Side(NamedTuple):
    """The endpoints on one side of a topic or service.

    Attributes:
        kind: Their kind.
        noun: Their name.
        heading: The heading of their number.
    """

    kind: EntryKind
    noun: str
    heading: str


class Named(NamedTuple):
    """Topics, services or actions.

    Attributes:
        noun: "topic", "service" or "action", which is also the name of the argument.
        example: A name.
        example_type: A type.
        kinds: The kinds of endpoints with which a name exists.
        sides: Its endpoints, in the order in which `info` prints them.
        validate: Raises if a full name is invalid.
    """

    noun: str
    example: str
    example_type: str
    kinds: tuple[EntryKind, ...]
    sides: tuple[Side, Side]
    validate: Callable[[str], object]

    def names_and_types(self, snapshot: GraphSnapshot) -> NamesAndTypes:
        """Return the names in a graph. An action has the name and type of its service for goals."""
        from actors.graph.snapshot import actions_among

        found = snapshot.names_and_types(*self.kinds)
        return actions_among(found) if self.noun == "action" else found

    def full_name(self, text: str) -> str:
        """Return the full name; the first slash may be left out.

        Raises:
            InvalidNameError: The name is invalid.
        """
        full = absolute(text)
        self.validate(full)
        return full

    def option(self, options: Options, name: str) -> Any:
        """Return an option whose name ends with the noun, such as `count_topics`."""
        return getattr(options, f"{name}_{self.noun}s")


TOPIC: Final = Named(
    "topic",
    "/chatter",
    "std_msgs/msg/String",
    (EntryKind.PUBLISHER, EntryKind.SUBSCRIPTION),
    (
        Side(EntryKind.PUBLISHER, "publisher", "Publisher count"),
        Side(EntryKind.SUBSCRIPTION, "subscription", "Subscription count"),
    ),
    validate_full_topic_name,
)
SERVICE: Final = Named(
    "service",
    "/add_two_ints",
    "std_srvs/srv/Trigger",
    (EntryKind.SERVICE,),
    (
        Side(EntryKind.CLIENT, "client", "Clients count"),
        Side(EntryKind.SERVICE, "server", "Services count"),
    ),
    validate_full_service_name,
)
ACTION: Final = Named(
    "action",
    "/fibonacci",
    "example_interfaces/action/Fibonacci",
    (EntryKind.SERVICE, EntryKind.CLIENT),
    (
        Side(EntryKind.CLIENT, "client", "Action clients"),
        Side(EntryKind.SERVICE, "server", "Action servers"),
    ),
    validate_full_topic_name,
)


_MISMATCHES: Final = 20
"""Lines about nodes that are not connected."""


def absolute(text: str) -> str:
    """Return a name with its first slash."""
    return text if text.startswith("/") or not text else f"/{text}"


def unknown(text: str, name: str, known: Iterable[str]) -> CommandError:
    """Return the error for a name that is not in the graph, with a suggestion.

    Args:
        text: ROS 2's text.
        name: The name.
        known: The names in the graph.
    """
    from actors.cli.errors import CommandError
    from actors.tools.suggestions import did_you_mean

    return CommandError(f"{text}{did_you_mean(name, known)}")


def print_unpublished(topic: str, known: Iterable[str]) -> None:
    """Warn on stderr that a topic has no publisher yet, with a suggestion."""
    from actors.cli.output import print_err
    from actors.tools.suggestions import did_you_mean

    hint = did_you_mean(topic, set(known) - {topic})
    print_err(f"WARNING: topic [{topic}] does not appear to be published yet{hint}")


def add_hidden_option(named: Named, parser: Parser) -> None:
    """Add ROS 2's option for names with a leading underscore."""
    parser.add_flag(f"--include-hidden-{named.noun}s", help="also names with a leading _")


def add_list_options(named: Named, parser: Parser) -> None:
    """Add ROS 2's options of `list`."""
    parser.add_flag("-t", "--show-types", help="with their types")
    parser.add_flag("-c", f"--count-{named.noun}s", help="only how many there are")


def list_names(named: Named, options: Options) -> int:
    """Print the names; return the exit code."""
    from actors.cli.output import print_json
    from actors.cli.tables import Styled, print_styled

    found = _names_and_types(named, options, hidden=named.option(options, "include_hidden"))
    if named.option(options, "count"):
        print_json(len(found))
    elif options.json:
        print_json([{"name": name, "types": types} for name, types in found])
    else:
        for name, types in found:
            print_styled(Styled(name, "name"), *(types_shown(types) if options.show_types else ()))
    return 0


def types_shown(types: list[str]) -> tuple[str | Styled, ...]:
    """Return ` [type, type]` as parts of a line."""
    from actors.cli.tables import Styled

    return (" [", Styled(", ".join(types), "type"), "]")


def add_find_arguments(named: Named, parser: Parser) -> None:
    """Add the arguments of `find`."""
    parser.add_argument("type", metavar="TYPE", help=f"such as {named.example_type}")
    parser.add_flag("-c", f"--count-{named.noun}s", help="only how many there are")
    add_hidden_option(named, parser)
    add_json_option(parser, "one array of names")
    if named is TOPIC:
        add_ros_options(parser)
    add_broker_options(parser)


def find_names(named: Named, options: Options) -> int:
    """Print the names whose type is `options.type`; return the exit code."""
    from actors.cli.output import print_err, print_json, print_names
    from actors.tools.suggestions import did_you_mean

    every = _names_and_types(named, options, hidden=named.option(options, "include_hidden"))
    found = [name for name, types in every if any(_same_type(options.type, each) for each in types)]
    if named.option(options, "count"):
        print_json(len(found))
    else:
        print_names(found, json=options.json)
    if not found and (hint := did_you_mean(options.type, {each for _, types in every for each in types})):
        print_err(f"Nothing has type '{options.type}'{hint}")
    return 0


def add_type_arguments(named: Named, parser: Parser) -> None:
    """Add the arguments of `type`."""
    parser.add_argument(named.noun, metavar=named.noun.upper(), help=f"such as {named.example}")
    add_hidden_option(named, parser)
    add_json_option(parser, "one array of types")
    if named is TOPIC:
        add_ros_options(parser)
    add_broker_options(parser)


def print_types(named: Named, options: Options) -> int:
    """Print the types of a name, one a line; return the exit code.

    Raises:
        CommandError: There is no such name.
    """
    from actors.cli.output import print_names

    noun, name = named.noun, named.full_name(getattr(options, named.noun))
    every = dict(_names_and_types(named, options, hidden=True))
    if name not in every:
        raise unknown(f"Unknown {noun} '{name}'", name, every)
    if is_hidden(name) and not named.option(options, "include_hidden"):
        raise unknown(f"Hidden {noun} '{name}': add --include-hidden-{noun}s", name, ())
    print_names(every[name], json=options.json)
    return 0


def add_info_arguments(named: Named, parser: Parser) -> None:
    """Add the arguments of `info`."""
    nouns = [side.noun for side in named.sides]
    parser.add_argument(named.noun, metavar=named.noun.upper(), help=f"such as {named.example}")
    parser.add_flag("-v", "--verbose", help=f"also each {' and '.join(nouns)}: node, type hash, QoS")
    add_json_option(parser, f"one object: name, types, {', '.join(f'{noun}s' for noun in nouns)}, mismatches")
    add_ros_options(parser)
    add_broker_options(parser)


def print_info(named: Named, options: Options) -> int:
    """Print the type and the endpoints of a name; return the exit code.

    Raises:
        CommandError: There is no such name.
    """
    from actors.cli.broker_target import open_inspector
    from actors.cli.mesh_names import read_broker_names
    from actors.cli.output import print_json
    from actors.tools.graph_drawing.mismatches import mismatches_of

    name = named.full_name(getattr(options, named.noun))
    with open_inspector(options) as inspector:
        snapshot = inspector.graph()
        names = read_broker_names(inspector, snapshot) if options.json or options.verbose else None
        topics = inspector.report().topics if options.verbose and named is TOPIC else {}
    types = dict(snapshot.names_and_types(*(side.kind for side in named.sides)))
    if name not in types:
        raise unknown(f"Unknown {named.noun} '{name}'", name, types)
    if options.json:
        from actors.tools import graph_documents

        document = graph_documents.topic if named is TOPIC else graph_documents.service
        print_json(document(snapshot, name, names))
        return 0
    found = {side: snapshot.endpoints(side.kind, name) for side in named.sides}
    _print_info(types[name], found, names, verbose=options.verbose)
    if name in topics:
        _print_shared(topics[name])
    kinds = [side.kind for side in named.sides]
    print_mismatches(mismatches_of(each for each in snapshot.of_kind(*kinds) if each.name == name))
    return 0


def print_mismatches(mismatches: Sequence[Mismatch]) -> None:
    """Print on stderr which nodes a topic or service does not connect, a line for each of the first 20."""
    from actors.cli.output import print_err

    for each in mismatches[:_MISMATCHES]:
        print_err(each.text)
    if (more := len(mismatches) - _MISMATCHES) > 0:
        print_err(f"… and {more} more like this; see --json")


def _print_shared(stats: TopicStats) -> None:
    """Print how many messages of a topic were in shared memory, if some were or their size asks for it."""
    from actors.session.shared_memory import MIN_BYTES

    if stats.by_reference or (stats.messages and stats.bytes >= MIN_BYTES * stats.messages):
        print(f"In shared memory: {stats.by_reference} of {stats.messages} messages")


def _print_info(
    types: list[str], found: dict[Side, list[EndpointInfo]], names: BrokerNames | None, *, verbose: bool
) -> None:
    from actors.cli.tables import Styled, print_styled

    joined = types[0] if len(types) == 1 else str(types)
    print_styled("Type: ", Styled(joined if types else "any", "type"))  # any: only raw subscriptions
    if verbose:
        print()
    for side, endpoints in found.items():
        print_styled(f"{side.heading}: ", Styled(str(len(endpoints)), "heading"))
        if verbose:
            print()
            for endpoint in endpoints:
                for line in str(endpoint).splitlines():
                    label, colon, value = line.partition(":")
                    shown = Styled(value, "name") if label == "Node name" else value
                    print_styled(Styled(label, "dim"), colon, shown)
                    if label == "Node namespace" and names is not None:
                        print_styled(Styled("Broker", "dim"), ": ", names[endpoint.broker])
                print()


def _names_and_types(named: Named, options: Options, *, hidden: bool) -> NamesAndTypes:
    from actors.cli.broker_target import open_inspector

    with open_inspector(options) as inspector:
        names = named.names_and_types(inspector.graph())
    return [each for each in names if hidden or not is_hidden(each[0])]


def _same_type(wanted: str, found: str) -> bool:
    """Return whether two type names are the same; the wanted one may omit its kind, as in std_msgs/String."""
    package, _, name = found.split("/") if found.count("/") == 2 else ("", "", found)
    return wanted in {found, f"{package}/{name}"}
