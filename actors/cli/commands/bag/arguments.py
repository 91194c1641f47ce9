"""The arguments that several verbs of `callboard bag` have, and what they mean."""

from __future__ import annotations

from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, Final

from actors.cli.errors import USAGE, CommandError
from actors.cli.parsing import IGNORED, LOG_LEVELS, count_or_zero, size

# Reading arguments needs nothing else.

if TYPE_CHECKING:
    from collections.abc import Generator, Iterable, Sequence

    from actors.bags.selection import Selection
    from actors.cli.parsing import Options, Parser
    from actors.qos.profile import QoSProfile


STORAGES: Final = ("mcap", "sqlite3")
"""ROS 2's names of the formats of files."""
_FLAGS: Final = {
    "clock_hz": "--clock",
    "duration_sec": "--playback-duration",
    "read_ahead": "--read-ahead-queue-size",
}
"""The options of the API whose flags ROS 2 names otherwise; see `flag_of`."""


def flag_of(option: str) -> str:
    """Return the flag for an option of a recorder, a player or a writer.

    Args:
        option: The option's name in the API. Flags lack its unit.
    """
    return _FLAGS.get(option) or f"--{option.removesuffix('_sec').replace('_', '-')}"


@contextmanager
def usage_errors() -> Generator[None]:
    """Report options that the recorder, the player or the writer refuses as usage errors, by their flags."""
    import re

    from actors.bags.errors import InvalidBagOptionError

    try:
        yield
    except InvalidBagOptionError as error:
        text = str(error)
        for option in error.options:
            text = re.sub(rf"\b{option}\b", flag_of(option), text)
        raise CommandError(text, USAGE) from None


def add_bag(parser: Parser, *, nargs: str | None = None) -> None:
    """Add the bag that is read.

    Args:
        parser: The verb's.
        nargs: "?" if it may be left out.
    """
    parser.add_argument(
        "bag_path", metavar="BAG", nargs=nargs, help="the folder of a bag, or a .mcap or .db3 file"
    )


def add_storage(parser: Parser) -> None:
    """Add ROS 2's option for the format of the files that are read."""
    parser.add_argument(
        *("-s", "--storage"), choices=STORAGES, help=f"{IGNORED} the format is read from the files"
    )


def add_topics(parser: Parser) -> None:
    """Add the choice of topics for verbs that read and write without a broker."""
    parser.add_argument("--topics", nargs="+", metavar="TOPIC", help="only these topics; default: all")


def add_compression(parser: Parser, *, default: str | None = "none") -> None:
    """Add the compression of a bag that is written.

    Args:
        parser: The verb's.
        default: The value without the option; None if other options can choose a compression, too.
    """
    parser.add_argument(
        "--compression", choices=("none", "zstd", "lz4"), metavar="NAME", default=default,
        help="compress messages in chunks, with zstd or lz4; default: none",
    )  # fmt: skip


def add_file_limits(parser: Parser) -> None:
    """Add the limits at which a bag that is written continues in another file."""
    parser.add_argument(
        "-b", "--max-bag-size", type=size, metavar="BYTES", default=0,
        help="start a new file at this size; default: never",
    )  # fmt: skip
    parser.add_argument(
        "-d", "--max-bag-duration", type=count_or_zero, metavar="SEC", default=0,
        help="start a new file after this time; default: never",
    )  # fmt: skip


def add_names(parser: Parser, verb: str, *, exclude_regex: Sequence[str] = ("--exclude-regex",)) -> None:
    """Add the choice of topics, services and actions by name.

    Args:
        parser: The verb's.
        verb: What is done with them, such as "record".
        exclude_regex: The names of the option for a regular expression that excludes: ROS 2's verbs differ.
    """
    for what, noun in {"topics": "TOPIC", "services": "SERVICE", "actions": "ACTION"}.items():
        parser.add_argument(f"--{what}", nargs="+", metavar=noun, default=[], help=f"{what} to {verb}")
        parser.add_argument(
            f"--exclude-{what}", nargs="+", metavar=noun, default=[], help=f"{what} not to {verb}"
        )
    parser.add_argument(
        "-e", "--regex", metavar="REGEX", default="",
        help=f"{verb} topics, services and actions whose names contain a match",
    )  # fmt: skip
    parser.add_argument(
        *exclude_regex, metavar="REGEX", default="",
        help=f"{verb} no topics, services and actions whose names contain a match",
    )  # fmt: skip


def selection_of(options: Options, topics: Iterable[str], **others: Any) -> Selection:
    """Return what the options select; names may lack their first slash.

    Args:
        options: The command line, with the arguments of `add_names`.
        topics: The names of the topics to select.
        **others: Further fields of the selection.

    Raises:
        InvalidBagOptionError: Nothing is selected, or a regular expression is invalid.
    """
    from actors.bags.selection import Selection
    from actors.cli.named import absolute

    def names(of: Iterable[str]) -> tuple[str, ...]:
        return tuple(map(absolute, of))

    return Selection(
        topics=names(topics),
        services=names(options.services),
        actions=names(options.actions),
        regex=options.regex,
        exclude_regex=options.exclude_regex,
        exclude_topics=names(options.exclude_topics),
        exclude_services=names(options.exclude_services),
        exclude_actions=names(options.exclude_actions),
        **others,
    )


def add_qos_overrides(parser: Parser, endpoints: str) -> None:
    """Add the file with the QoS of single topics.

    Args:
        parser: The verb's.
        endpoints: Which endpoints have this QoS, and what others have.
    """
    parser.add_argument(
        "--qos-profile-overrides-path", metavar="FILE", help=f"a YAML file with the QoS of {endpoints}"
    )


def qos_overrides_of(options: Options) -> dict[str, QoSProfile]:
    """Return the profiles in the file of `add_qos_overrides`, by topic; none without a file.

    Raises:
        CommandError: The file cannot be read, or something in it is wrong.
    """
    path: str | None = options.qos_profile_overrides_path
    if path is None:
        return {}
    from pathlib import Path

    from actors.bags.errors import InvalidBagOptionError
    from actors.bags.qos_override_file import read_overrides
    from actors.interfaces.yaml_reader import YamlError

    try:
        return read_overrides(Path(path).read_bytes())
    except OSError as error:
        raise CommandError(f"{path}: {error.strerror or error}") from None
    except (YamlError, InvalidBagOptionError) as error:
        raise CommandError(f"{path}: {error}") from None


def add_node(parser: Parser, name: str) -> None:
    """Add the name of the verb's node, and what it logs.

    Args:
        parser: The verb's.
        name: The default.
    """
    parser.add_argument("--node-name", metavar="NAME", help=f"the name of the node; default: {name}")
    parser.add_argument("--log-level", choices=LOG_LEVELS, help="the least severity to log; default: info")
