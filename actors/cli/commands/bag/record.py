"""`callboard bag record`: record topics into a bag."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

from actors.cli.commands.bag import arguments
from actors.cli.errors import OK, USAGE, CommandError
from actors.cli.parsing import IGNORED, Options, Parser, add_broker_options, count_or_zero, positive, size

# Reading arguments needs nothing else.

if TYPE_CHECKING:
    from actors.bags.recorder.options import RecorderOptions
    from actors.bags.recorder.recorder import Recorder
    from actors.bags.selection import Selection

EXAMPLES: Final = {
    "callboard bag record -a": "all topics, services and actions, until Ctrl-C",
    "callboard bag record /imu /camera/image -o trip": "two topics, into the folder trip",
    "callboard bag record -a -d 60 --max-splits 10": "files of one minute, keeping the last ten",
    "callboard bag record -e '^/arm/' --compression zstd": "topics below /arm, compressed",
    "callboard bag record -a --snapshot-mode": "the newest 100 MB, each time ~/snapshot is called",
}
PRESETS: Final = {"none": "none", "zstd_fast": "zstd", "zstd_small": "zstd"}
"""Presets of ROS 2's storage, with the compression that they mean. ROS 2's `fastwrite` is left out: its files
have no index, and many readers show them as empty."""


def add_arguments(parser: Parser) -> None:
    """Describe the arguments."""
    parser.add_argument("topics_positional", nargs="*", metavar="TOPIC", help="topics to record")
    parser.add_argument(
        "-o", "--output", metavar="DIR",
        help="the folder to create; default: rosbag2_ with the date and time, in the working directory",
    )  # fmt: skip
    parser.add_argument("-s", "--storage", choices=("mcap",), help="the format of the files: always mcap")
    _add_selection(parser)
    _add_discovery(parser)
    _add_files(parser)
    _add_control(parser)
    _add_ignored(parser)
    add_broker_options(parser)


def _add_selection(parser: Parser) -> None:
    parser.add_flag("-a", "--all", help="record all topics, services and actions that are not hidden")
    parser.add_flag("--all-topics", help="record all topics that are not hidden")
    parser.add_flag("--all-services", help="record the service events of all services")
    parser.add_flag("--all-actions", help="record the topics and service events of all actions")
    arguments.add_names(parser, "record")
    parser.add_argument(
        "--topic-types", nargs="+", metavar="TYPE", default=[], help="record the topics of these types"
    )
    parser.add_argument(
        "--exclude-topic-types", nargs="+", metavar="TYPE", default=[], help="record no topics of these types"
    )


def _add_discovery(parser: Parser) -> None:
    parser.add_flag("--include-unpublished-topics", help="record topics without a publisher, too")
    parser.add_flag("--include-hidden-topics", help="record topics with a token that begins with _, too")
    parser.add_flag("--no-discovery", help="record only topics that exist at the start")
    parser.add_flag("--ignore-leaf-topics", help="record no topics without other subscriptions")
    arguments.add_qos_overrides(
        parser, "the recorder's subscriptions, by topic; default: what all publishers of a topic offer"
    )
    parser.add_flag("--lossless", help="let KEEP_ALL publishers wait for the disk rather than drop messages")


def _add_files(parser: Parser) -> None:
    arguments.add_file_limits(parser)
    parser.add_argument(
        "--max-bag-files", "--max-splits", type=count_or_zero, metavar="N", default=0,
        help="keep only this many files, the newest; default: all",
    )  # fmt: skip
    parser.add_argument(
        "--max-cache-size", type=size, metavar="BYTES", default=None,
        help="the limit for messages that wait in memory for the disk, and for a snapshot; beyond it,"
        " messages are dropped and counted. 0: write each message at once; default: 104857600",
    )  # fmt: skip
    arguments.add_compression(parser, default=None)
    parser.add_argument(
        "--compression-mode", choices=("none", "file", "message"), default="none",
        help="file and message: compress messages in chunks",
    )  # fmt: skip
    parser.add_argument(
        "--compression-format", choices=("zstd", "lz4"), metavar="NAME",
        help="zstd or lz4, with --compression-mode; default: zstd",
    )  # fmt: skip
    parser.add_argument(
        "--storage-preset-profile", choices=tuple(PRESETS), metavar="NAME", default="none",
        help="zstd_fast and zstd_small: as --compression zstd",
    )  # fmt: skip
    parser.add_flag("--fsync", help="sync each chunk to the disk, so that it survives a power loss; slower")
    parser.add_argument(
        "--custom-data", nargs="*", metavar="KEY=VALUE", default=[],
        help="strings to store in the bag's metadata",
    )  # fmt: skip


def _add_control(parser: Parser) -> None:
    parser.add_flag("--start-paused", help="record nothing until the space key or the service ~/resume")
    parser.add_flag("--disable-keyboard-controls", help="do not pause when the space key is pressed")
    parser.add_flag(
        "--snapshot-mode", help="keep the newest messages in memory, and write them when ~/snapshot is called"
    )
    parser.add_flag(
        "--use-sim-time", help="take log times from /clock, and record nothing before its first message"
    )
    parser.add_argument(
        "--until-no-messages", type=positive, metavar="SEC",
        help="stop when no message has arrived for this long",
    )  # fmt: skip
    arguments.add_node(parser, "bag_recorder")


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
        help=f"{IGNORED} each file begins with the latched messages of all topics",
    )  # fmt: skip
    for name, what in {"queue-size": "queue", "threads": "threads", "threads-priority": "threads"}.items():
        parser.add_argument(
            f"--compression-{name}", type=int, metavar="N",
            help=f"{IGNORED} compression has no {what} of its own",
        )  # fmt: skip


def run(options: Options) -> int:
    """Record until SIGINT or SIGTERM, or until the recording ends by itself."""
    from actors.cli.loop import run_async
    from actors.cli.parsing import import_from_working_directory
    from proto.aio import process

    import_from_working_directory()
    with arguments.usage_errors():
        selection, chosen = _selection(options), _recorder_options(options)
    run_async(lambda: _record(options, selection, chosen), loop_factory=process.new_event_loop)
    return OK


def _selection(options: Options) -> Selection:
    return arguments.selection_of(
        options,
        [*options.topics_positional, *options.topics],
        topic_types=tuple(options.topic_types),
        exclude_topic_types=tuple(options.exclude_topic_types),
        all_topics=options.all or options.all_topics,
        all_services=options.all or options.all_services,
        all_actions=options.all or options.all_actions,
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
        qos_overrides=arguments.qos_overrides_of(options),
        custom_data=dict(map(_pair, options.custom_data)),
        **given,
    )


def _compression(options: Options) -> str:
    """Return the compression of chunks, from callboard's option or from ROS 2's.

    ROS 2 can also compress messages one by one and files as a whole. callboard compresses chunks for all of
    these options: other tools then find messages by the index, and a killed recorder leaves whole chunks.
    """
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


async def _record(options: Options, selection: Selection, chosen: RecorderOptions) -> None:
    from contextlib import AsyncExitStack
    from functools import partial

    from actors.bags.recorder.recorder import Recorder
    from actors.cli.commands.bag.running import running
    from actors.cli.keys import handling_keys
    from actors.cli.output import print_out

    async with AsyncExitStack() as stack:
        make = partial(Recorder, options.output or _default_name(), selection, chosen)
        recorder = await stack.enter_async_context(running(options, make, _print_summary))
        print_out(f"Recording into {recorder.path}")

        async def obey(key: str) -> None:
            if key == " ":
                recorder.toggle_paused()

        if not options.disable_keyboard_controls:
            await stack.enter_async_context(handling_keys(obey))
        await recorder.wait()


def _default_name() -> str:
    import time

    return time.strftime("rosbag2_%Y_%m_%d-%H_%M_%S")


def _print_summary(recorder: Recorder) -> None:
    from actors.cli.commands.bag.summaries import summary_of
    from actors.cli.output import print_out

    found = recorder.statistics()
    missing = {
        "lost on the way to the recorder": found.lost,
        "dropped at the memory limit": found.dropped,
        "invalid": found.invalid,
    }
    print_out(summary_of(recorder.path, found.topics, "not recorded", missing))
