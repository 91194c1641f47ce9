"""`callboard bag record`: write what topics carry into a bag."""

from __future__ import annotations

import argparse
import re
from typing import TYPE_CHECKING, Any, Final

from actors.cli.errors import OK, USAGE, CommandError
from actors.cli.parsing import IGNORED, Options, Parser, add_broker_options, count_or_zero, positive

# Reading arguments needs nothing else.

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    from actors.bags.recorder.options import RecorderOptions
    from actors.bags.recorder.recorder import Recorder
    from actors.bags.recorder.selection import Selection
    from actors.qos.profile import QoSProfile

EXAMPLES: Final = {
    "callboard bag record -a": "all topics, services and actions, until Ctrl-C",
    "callboard bag record /imu /camera/image -o trip": "two topics, into the folder trip",
    "callboard bag record -a -d 60 --max-splits 10": "files of a minute, the last ten of them",
    "callboard bag record -e '^/arm/' --compression zstd": "what is below /arm, compressed",
    "callboard bag record -a --snapshot-mode": "the newest 100 MB, whenever ~/snapshot is called",
}
LEVELS: Final = ("debug", "info", "warn", "error", "fatal")
PRESETS: Final = {"none": "none", "zstd_fast": "zstd", "zstd_small": "zstd"}
"""Presets of ROS 2's storage, with the compression that they mean. `fastwrite` writes files without an index,
which many readers show as empty."""


def add_arguments(parser: Parser) -> None:
    """Describe the arguments."""
    parser.add_argument("topics_positional", nargs="*", metavar="TOPIC", help="topics to record")
    parser.add_argument(
        "-o", "--output", metavar="DIR",
        help="the folder to make; default: rosbag2_ and the date and time, in the working directory",
    )  # fmt: skip
    parser.add_argument(
        "-s", "--storage", choices=("mcap",), help="the kind of files; there is no other than mcap"
    )
    _add_selection(parser)
    _add_discovery(parser)
    _add_files(parser)
    _add_control(parser)
    _add_ignored(parser)
    add_broker_options(parser)


def _add_selection(parser: Parser) -> None:
    for what, noun in {"topics": "TOPIC", "services": "SERVICE", "actions": "ACTION"}.items():
        parser.add_argument(f"--{what}", nargs="+", metavar=noun, default=[], help=f"{what} to record")
    parser.add_argument(
        "--topic-types", nargs="+", metavar="TYPE", default=[], help="record the topics of these types"
    )
    parser.add_flag("-a", "--all", help="record all topics, services and actions that are not hidden")
    parser.add_flag("--all-topics", help="record all topics that are not hidden")
    parser.add_flag("--all-services", help="record the service events of all services")
    parser.add_flag("--all-actions", help="record the topics and service events of all actions")
    parser.add_argument(
        "-e", "--regex", metavar="REGEX", default="",
        help="record topics, services and actions in whose names this is found",
    )  # fmt: skip
    parser.add_argument(
        "--exclude-regex", metavar="REGEX", default="", help="record none in whose names this is found"
    )
    parser.add_argument(
        "--exclude-topic-types", nargs="+", metavar="TYPE", default=[], help="record no topics of these types"
    )
    for what, noun in {"topics": "TOPIC", "services": "SERVICE", "actions": "ACTION"}.items():
        parser.add_argument(
            f"--exclude-{what}", nargs="+", metavar=noun, default=[], help=f"{what} that are not recorded"
        )


def _add_discovery(parser: Parser) -> None:
    parser.add_flag("--include-unpublished-topics", help="record topics without a publisher, too")
    parser.add_flag("--include-hidden-topics", help="record topics with a token that begins with _, too")
    parser.add_flag("--no-discovery", help="record only topics that exist at the start")
    parser.add_flag("--ignore-leaf-topics", help="record no topics that nobody else subscribes to")
    parser.add_argument(
        "--qos-profile-overrides-path", metavar="FILE",
        help="a YAML file with the QoS of subscriptions, by topic",
    )  # fmt: skip
    parser.add_flag("--lossless", help="let KEEP_ALL publishers wait for the disk rather than drop messages")


def _add_files(parser: Parser) -> None:
    parser.add_argument(
        "-b", "--max-bag-size", type=size, metavar="BYTES", default=0,
        help="begin the next file after this size; default: never",
    )  # fmt: skip
    parser.add_argument(
        "-d", "--max-bag-duration", type=count_or_zero, metavar="SEC", default=0,
        help="begin the next file after this time; default: never",
    )  # fmt: skip
    parser.add_argument(
        "--max-bag-files", "--max-splits", type=count_or_zero, metavar="N", default=0,
        help="keep only the newest files of the bag; default: all",
    )  # fmt: skip
    parser.add_argument(
        "--max-cache-size", type=size, metavar="BYTES", default=None,
        help="what may wait in memory for the disk, and what a snapshot has; beyond it messages are dropped, "
        "and counted. 0: write each message at once. Default: 104857600",
    )  # fmt: skip
    parser.add_argument(
        "--compression", choices=("none", "zstd", "lz4"), metavar="NAME",
        help="compress the chunks of files: zstd, lz4, or none, the default",
    )  # fmt: skip
    parser.add_argument(
        "--compression-mode", choices=("none", "file", "message"), default="none",
        help="file and message: compress the chunks of files",
    )  # fmt: skip
    parser.add_argument(
        "--compression-format", choices=("zstd", "lz4"), metavar="NAME",
        help="zstd or lz4; default: zstd, with --compression-mode",
    )  # fmt: skip
    parser.add_argument(
        "--storage-preset-profile", choices=tuple(PRESETS), metavar="NAME", default="none",
        help="zstd_fast and zstd_small: as --compression zstd",
    )  # fmt: skip
    parser.add_flag("--fsync", help="let what is written survive a loss of power, too; it costs time")
    parser.add_argument(
        "--custom-data", nargs="*", metavar="KEY=VALUE", default=[], help="texts for the bag's metadata"
    )


def _add_control(parser: Parser) -> None:
    parser.add_flag("--start-paused", help="record nothing before the space key or the service ~/resume")
    parser.add_flag("--disable-keyboard-controls", help="the space key does not pause")
    parser.add_flag(
        "--snapshot-mode", help="keep the newest messages in memory, and write them when ~/snapshot is called"
    )
    parser.add_flag("--use-sim-time", help="log times are those of /clock, and nothing is recorded before it")
    parser.add_argument(
        "--until-no-messages",
        type=positive,
        metavar="SEC",
        help="end when no message arrives for so long",
    )
    parser.add_argument("--node-name", metavar="NAME", help="the name of the node; default: bag_recorder")
    parser.add_argument("--log-level", choices=LEVELS, help="what the node logs; default: info")


def _add_ignored(parser: Parser) -> None:
    parser.add_argument(
        "-p", "--polling-interval", type=count_or_zero, metavar="MS",
        help=f"{IGNORED} the broker reports new topics at once",
    )  # fmt: skip
    parser.add_argument(
        "-f", "--serialization-format", choices=("cdr",), help=f"{IGNORED} messages are always CDR"
    )
    parser.add_argument(
        "--repeat-transient-local", nargs="+", metavar="TOPIC",
        help=f"{IGNORED} each file begins with the newest latched messages of all topics",
    )  # fmt: skip
    for name, what in {"queue-size": "queue", "threads": "threads", "threads-priority": "threads"}.items():
        parser.add_argument(
            f"--compression-{name}", type=int, metavar="N",
            help=f"{IGNORED} compression has no {what} of its own",
        )  # fmt: skip


def size(text: str) -> int:
    """Read a number of bytes, of 0 or more."""
    if not re.fullmatch(r"[0-9]{1,15}", text):
        raise argparse.ArgumentTypeError(f"expected a number of bytes, got '{text}'")
    return int(text)


def run(options: Options) -> int:
    """Record until SIGINT or SIGTERM, or until the recording ends by itself."""
    from actors.bags.recorder.errors import InvalidRecordingError
    from actors.cli.loop import run_async
    from actors.cli.parsing import import_from_working_directory

    import_from_working_directory()
    try:
        selection, chosen = _selection(options), _recorder_options(options)
    except InvalidRecordingError as error:
        raise CommandError(str(error), USAGE) from None
    run_async(lambda: _record(options, selection, chosen))
    return OK


def _selection(options: Options) -> Selection:
    from actors.bags.recorder.selection import Selection
    from actors.cli.named import absolute

    def names(of: list[str]) -> tuple[str, ...]:
        return tuple(map(absolute, of))

    return Selection(
        topics=names([*options.topics_positional, *options.topics]),
        services=names(options.services),
        actions=names(options.actions),
        topic_types=tuple(options.topic_types),
        all_topics=options.all or options.all_topics,
        all_services=options.all or options.all_services,
        all_actions=options.all or options.all_actions,
        regex=options.regex,
        exclude_regex=options.exclude_regex,
        exclude_topics=names(options.exclude_topics),
        exclude_services=names(options.exclude_services),
        exclude_actions=names(options.exclude_actions),
        exclude_topic_types=tuple(options.exclude_topic_types),
        include_hidden_topics=options.include_hidden_topics,
        include_unpublished_topics=options.include_unpublished_topics,
        ignore_leaf_topics=options.ignore_leaf_topics,
    )


def _recorder_options(options: Options) -> RecorderOptions:
    from actors.bags.recorder.options import RecorderOptions

    given: dict[str, Any] = (
        {} if options.max_cache_size is None else {"max_cache_size": options.max_cache_size}
    )
    return RecorderOptions(
        max_bag_size=options.max_bag_size,
        max_bag_duration_sec=options.max_bag_duration,
        max_splits=options.max_bag_files,
        compression=_compression(options),
        fsync=options.fsync,
        lossless=options.lossless,
        snapshot_mode=options.snapshot_mode,
        start_paused=options.start_paused,
        no_discovery=options.no_discovery,
        use_sim_time=options.use_sim_time,
        until_no_messages_sec=options.until_no_messages or 0,
        qos_overrides=overrides_of(options.qos_profile_overrides_path),
        custom_data=dict(map(_pair, options.custom_data)),
        **given,
    )


def _compression(options: Options) -> str:
    """Return the compression of chunks, from callboard's option or from ROS 2's."""
    if options.compression is not None:
        return str(options.compression)
    if options.compression_mode != "none":
        return str(options.compression_format or "zstd")
    if options.compression_format is not None:
        raise CommandError("--compression-format needs --compression-mode; or use --compression", USAGE)
    return PRESETS[options.storage_preset_profile]


def _pair(text: str) -> tuple[str, str]:
    key, sign, value = text.partition("=")
    if not (key and sign):
        raise CommandError(f"--custom-data: expected KEY=VALUE, got '{text}'", USAGE)
    return key, value


def overrides_of(path: str | None) -> dict[str, QoSProfile]:
    """Return the profiles in a file of QoS overrides, by topic.

    Args:
        path: The file; None for none.

    Raises:
        CommandError: It cannot be read, or has something else.
    """
    if path is None:
        return {}
    from pathlib import Path

    from actors.bags.recorder.errors import InvalidRecordingError
    from actors.bags.recorder.recording_qos import read_overrides
    from actors.interfaces.yaml_reader import YamlError

    try:
        return read_overrides(Path(path).read_bytes())
    except OSError as error:
        raise CommandError(f"{path}: {error.strerror or error}") from None
    except (YamlError, InvalidRecordingError) as error:
        raise CommandError(f"{path}: {error}") from None


async def _record(options: Options, selection: Selection, chosen: RecorderOptions) -> None:
    import asyncio

    from actors.bags.recorder.recorder import NODE_NAME, Recorder
    from actors.cli.broker_target import CONNECT_TIMEOUT_SEC, target_of, why_unreachable
    from actors.cli.output import print_out
    from actors.errors import BrokerUnreachable
    from actors.logging.output import configure_logging
    from actors.logging.severity import severity_from_name

    if options.own_process:
        configure_logging(severity_from_name(options.log_level or "info"))
    target = target_of(options)
    recorder = Recorder(
        options.output or _default_name(),
        selection,
        chosen,
        node_name=options.node_name or NODE_NAME,
        url=target.url,
        domain=target.domain,
        connect_timeout_sec=CONNECT_TIMEOUT_SEC,
    )
    begun = False
    try:
        async with recorder:
            begun = True
            print_out(f"Recording into {recorder.path}")
            await _until_end(recorder, with_keys=not options.disable_keyboard_controls)
    except BrokerUnreachable:
        if begun:
            raise
        raise await asyncio.to_thread(why_unreachable, target) from None
    finally:
        if begun:
            print_out(_summary(recorder))


async def _until_end(recorder: Recorder, *, with_keys: bool) -> None:
    """Wait for the end of the recording; the space key pauses it meanwhile."""
    import asyncio
    from contextlib import aclosing

    from actors.cli.keys import keys
    from proto.aio.tasks import cancel_and_wait

    async def obey() -> None:
        async with aclosing(keys()) as pressed:
            async for key in pressed:
                if key == " ":
                    recorder.toggle_paused()

    task = asyncio.create_task(obey()) if with_keys else None
    try:
        await recorder.wait()
    finally:
        if task is not None:
            await cancel_and_wait(task)


def _default_name() -> str:
    import time

    return time.strftime("rosbag2_%Y_%m_%d-%H_%M_%S")


def _summary(recorder: Recorder) -> str:
    found = recorder.statistics()
    missing = {
        "lost on the way": found.lost,
        "dropped, since the memory was full": found.dropped,
        "invalid": found.invalid,
    }
    return summary_of(recorder.path, found.written, found.topics, "not recorded", missing)


def summary_of(
    path: Path, messages: int, topics: Mapping[str, int], verdict: str, missing: Mapping[str, int]
) -> str:
    """Return how many messages were recorded or played, in one line.

    Args:
        path: The bag.
        messages: Their number.
        topics: Their number by topic.
        verdict: What the missing messages were not, such as "not played".
        missing: The number of these messages by reason.
    """
    count = sum(1 for each in topics.values() if each)
    parts = (
        f"{number:,} {noun}{'' if number == 1 else 's'}"
        for number, noun in ((messages, "message"), (count, "topic"))
    )
    reasons = ", ".join(f"{number:,} {reason}" for reason, number in missing.items() if number)
    return f"{path}: {' of '.join(parts)}{f'; {verdict}: {reasons}' if reasons else ''}"
