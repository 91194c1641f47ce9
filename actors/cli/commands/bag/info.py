"""`callboard bag info`: print what is in a bag."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

from actors.cli.commands.bag import arguments
from actors.cli.parsing import Options, Parser, add_json_option

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from actors.bags.contents.records import TopicCount
    from actors.bags.reader import BagSummary, Reader

EXAMPLES: Final = {
    "callboard bag info trip": "its files, times and topics, with the number of messages",
    "callboard bag info trip/trip_0.mcap --verbose": "one file, with the bytes of each topic",
    "callboard bag info trip --json": "the same for programs",
}
_EVENTS: Final = "/_service_event"
_INDENT: Final = 19


def add_arguments(parser: Parser) -> None:
    """Describe the arguments."""
    arguments.add_bag(parser)
    arguments.add_storage(parser)
    parser.add_flag("-t", "--topic-name", help="print only the names of topics")
    parser.add_flag("-v", "--verbose", help="also print the bytes of each topic, which reads the whole bag")
    parser.add_argument(
        "--sort", choices=("name", "type", "count"), default="name", help="the order of topics; default: name"
    )
    add_json_option(parser)


def run(options: Options) -> int:
    """Print what is in the bag."""
    from actors.bags.reader import Reader
    from actors.cli.output import print_json, print_names, print_out, print_warning

    with Reader(options.bag_path) as reader:
        summary = reader.summary()
        sizes = _sizes(reader) if options.verbose else {}
    topics = _sorted(summary.topics, options.sort)
    if options.json:
        print_json(_document(summary, topics, sizes))
    elif options.topic_name:
        print_names(each.topic.name for each in topics)
    else:
        print_out("\n".join(_lines(summary, topics, sizes)))
    for problem in summary.problems:
        print_warning(problem)
    return 0


def _sizes(reader: Reader) -> dict[str, int]:
    """Return the bytes of the messages of each topic."""
    sizes: dict[str, int] = {}
    for message in reader.messages(order="file"):
        sizes[message.topic.name] = sizes.get(message.topic.name, 0) + len(message.data)
    return sizes


def _sorted(topics: Iterable[TopicCount], by: str) -> list[TopicCount]:
    found = sorted(topics, key=lambda each: (each.topic.name, each.topic.type_name))
    if by == "type":
        found.sort(key=lambda each: each.topic.type_name)
    elif by == "count":
        found.sort(key=lambda each: each.message_count, reverse=True)
    return found


def _document(summary: BagSummary, topics: list[TopicCount], sizes: dict[str, int]) -> dict[str, Any]:
    return {
        "path": str(summary.path),
        "storage": summary.storage_identifier,
        "version": summary.version,
        "ros_distro": summary.ros_distro,
        "size": summary.size,
        "start_ns": summary.start_ns,
        "duration_ns": summary.duration_ns,
        "message_count": summary.message_count,
        "files": [
            {
                "path": each.path,
                "start_ns": each.start_ns,
                "duration_ns": each.duration_ns,
                "message_count": each.message_count,
            }
            for each in summary.files
        ],
        "topics": [
            {
                "name": each.topic.name,
                "type": each.topic.type_name,
                "type_hash": each.topic.type_hash,
                "serialization_format": each.topic.encoding,
                "message_count": each.message_count,
                "dropped": summary.dropped.get(each.topic.name, 0),
                **({"size": sizes.get(each.topic.name, 0)} if sizes else {}),
            }
            for each in topics
        ],
        "compression_format": summary.compression_format,
        "compression_mode": summary.compression_mode,
        "custom_data": dict(summary.custom_data),
        "problems": list(summary.problems),
    }


def _lines(summary: BagSummary, topics: list[TopicCount], sizes: dict[str, int]) -> Iterator[str]:
    """Yield the lines, as ROS 2 has them."""
    services = [each for each in topics if each.topic.name.endswith(_EVENTS)]
    others = [each for each in topics if each not in services]
    yield from _column("Files:", [each.path for each in summary.files])
    yield from _column("Bag size:", [_size(summary.size)])
    yield from _column("Storage id:", [summary.storage_identifier])
    yield from _column("ROS Distro:", [summary.ros_distro or "unknown"])
    yield from _column("Duration:", [f"{_seconds(summary.duration_ns)}s"])
    yield from _column("Start:", [_time(summary.start_ns)])
    yield from _column("End:", [_time(summary.end_ns)])
    if summary.compression_mode:
        yield from _column("Compression:", [f"{summary.compression_format}, {summary.compression_mode}"])
    events = sum(each.message_count for each in services)
    yield from _column("Messages:", [str(summary.message_count - events)])
    yield from _column("Topic information:", [_topic(each, "Topic", "Count", sizes) for each in others])
    yield from _column("Services:", [str(len(services))])
    if services:
        yield from _column(
            "Service information:", [_topic(each, "Service", "Event Count", sizes) for each in services]
        )
    if summary.dropped:
        lost = [f"Topic: {name} | Count: {count}" for name, count in sorted(summary.dropped.items())]
        yield from _column("Dropped:", lost)


def _column(title: str, values: list[str]) -> Iterator[str]:
    indent = max(_INDENT, len(title) + 1)
    for index, value in enumerate(values or [""]):
        yield f"{'' if index else title:<{indent}}{value}".rstrip()


def _topic(each: TopicCount, noun: str, count: str, sizes: dict[str, int]) -> str:
    size = f"Size Contribution: {_size(sizes.get(each.topic.name, 0))} | " if sizes else ""
    name, type_name = each.topic.name, each.topic.type_name
    if noun == "Service":
        name, type_name = name.removesuffix(_EVENTS), type_name.removesuffix("_Event")
    return (
        f"{noun}: {name} | Type: {type_name} | "
        f"{count}: {each.message_count} | {size}Serialization Format: {each.topic.encoding}"
    )


def _size(count: float) -> str:
    for unit in ("B", "KiB", "MiB", "GiB"):
        if count < 1024:
            return f"{count:.{unit != 'B':d}f} {unit}"
        count /= 1024
    return f"{count:.1f} TiB"


def _seconds(nanoseconds: int) -> str:
    return f"{nanoseconds // 10**9}.{nanoseconds % 10**9:09}"


def _time(nanoseconds: int) -> str:
    from datetime import datetime

    try:
        local = datetime.fromtimestamp(nanoseconds // 10**9).astimezone()
    except (OverflowError, OSError, ValueError):  # simulated time may be any number
        return f"({_seconds(nanoseconds)})"
    return f"{local:%b} {local.day:>2} {local:%Y %H:%M:%S}.{nanoseconds % 10**9:09} ({_seconds(nanoseconds)})"
