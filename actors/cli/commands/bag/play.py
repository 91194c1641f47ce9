"""`callboard bag play`: publish what a bag has."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

from actors.cli.errors import OK, USAGE, CommandError
from actors.cli.parsing import (
    IGNORED,
    Options,
    Parser,
    add_broker_options,
    add_json_option,
    count,
    count_or_zero,
    not_negative,
    positive,
)

if TYPE_CHECKING:
    from actors.bags.player.options import PlayerOptions
    from actors.bags.player.player import Player, PlayingStatistics
    from actors.bags.recorder.selection import Selection

EXAMPLES: Final = {
    "callboard bag play trip": "everything, as fast as it was recorded",
    "callboard bag play trip --rate 2 --loop --clock": "twice as fast, again and again, with simulated time",
    "callboard bag play trip --start-offset 5 --playback-duration 10": "ten seconds of it",
    "callboard bag play trip --topics /imu --remap /imu:=/imu2": "one topic, under another name",
    "callboard bag play trip.mcap --start-paused": "the space key begins, the right arrow plays a message",
}
LEVELS: Final = ("debug", "info", "warn", "error", "fatal")
CLOCK_HZ: Final = 40.0
RATE_STEP: Final = 1.1
_NS_PER_SEC: Final = 10**9
_BACK_AND_CLEAR: Final = "\r\x1b[K"


def add_arguments(parser: Parser) -> None:
    """Describe the arguments."""
    add_bag(parser)
    _add_time(parser)
    add_reading(parser)
    _add_selection(parser)
    add_names_and_qos(parser)
    _add_publishing(parser)
    _add_control(parser)
    add_node(parser)
    add_json_option(parser, "one document at the end")
    add_broker_options(parser)


def add_bag(parser: Parser) -> None:
    """Add the bag."""
    parser.add_argument("bag_path", metavar="BAG", help="the folder of a bag, or a file: .mcap or .db3")
    parser.add_argument(
        "-s", "--storage", choices=("mcap", "sqlite3"), help=f"{IGNORED} a file says itself what it is"
    )


def _add_time(parser: Parser) -> None:
    parser.add_argument(
        "-r", "--rate", type=positive, metavar="N", default=1.0, help="seconds of the bag for each second"
    )
    parser.add_flag("-l", "--loop", help="begin again at the end")
    parser.add_argument(
        "-d", "--delay", type=not_negative, metavar="SEC", default=0.0,
        help="wait so long before each pass through the bag",
    )  # fmt: skip
    parser.add_argument(
        "--playback-duration", type=float, metavar="SEC", default=-1.0,
        help="play this much of the bag; negative: all",
    )  # fmt: skip
    until = parser.add_mutually_exclusive_group()
    until.add_argument(
        "--playback-until-sec", type=float, metavar="SEC", default=-1.0,
        help="play up to this time, in seconds since 1970; with a duration, the later end counts",
    )  # fmt: skip
    until.add_argument(
        "--playback-until-nsec", type=int, metavar="NS", default=-1, help="the same in nanoseconds"
    )
    parser.add_argument(
        "--message-order", choices=("received", "sent"), default="received",
        help="whether messages are played by the times when they were received (default) or sent",
    )  # fmt: skip


def add_reading(parser: Parser) -> None:
    """Add where reading begins, and how far it is ahead."""
    parser.add_argument(
        "--start-offset", type=not_negative, metavar="SEC", default=0.0,
        help="begin so long after the first message",
    )  # fmt: skip
    parser.add_argument(
        "--read-ahead-queue-size", type=count, metavar="N", default=1000,
        help="messages that are read before they are due; default: 1000",
    )  # fmt: skip


def _add_selection(parser: Parser) -> None:
    for what, noun in {"topics": "TOPIC", "services": "SERVICE", "actions": "ACTION"}.items():
        parser.add_argument(f"--{what}", nargs="+", metavar=noun, default=[], help=f"{what} to play")
        parser.add_argument(
            f"--exclude-{what}", nargs="+", metavar=noun, default=[], help=f"{what} that are not played"
        )
    parser.add_argument(
        "-e", "--regex", metavar="REGEX", default="",
        help="play topics, services and actions in whose names this is found",
    )  # fmt: skip
    parser.add_argument(
        "-x", "--exclude-regex", metavar="REGEX", default="", help="play none in whose names this is found"
    )


def add_names_and_qos(parser: Parser) -> None:
    """Add how topics are published."""
    parser.add_argument(
        "-m", "--remap", nargs="+", metavar="OLD:=NEW", default=[], help="publish topics under other names"
    )
    parser.add_argument(
        "--qos-profile-overrides-path", metavar="FILE",
        help="a YAML file with the QoS of publishers, by topic; default: what was recorded",
    )  # fmt: skip


def _add_publishing(parser: Parser) -> None:
    clock = parser.add_mutually_exclusive_group()
    clock.add_argument(
        "--clock", type=positive, nargs="?", const=CLOCK_HZ, default=0.0, metavar="HZ",
        help="publish the time of the bag on /clock, also while paused; 40 times a second without a number",
    )  # fmt: skip
    clock.add_argument(
        "--clock-topics", nargs="+", metavar="TOPIC", default=[],
        help="publish it before each message of these topics",
    )  # fmt: skip
    clock.add_argument("--clock-topics-all", action="store_true", help="publish it before each message")
    parser.add_argument(
        "--wait-for-all-acked", type=count_or_zero, metavar="MS",
        help="at the end, wait at most so long until everything has reached the broker; 0: without a limit",
    )  # fmt: skip
    parser.add_flag("--disable-loan-message", help=f"{IGNORED} messages are not loaned")


def _add_control(parser: Parser) -> None:
    parser.add_flag("-p", "--start-paused", help="publish nothing before the space key or ~/resume")
    parser.add_flag(
        "--disable-keyboard-controls",
        help="without keys; else space pauses, the right arrow plays the next message while paused, and the"
        " arrows up and down change the rate by a tenth",
    )
    parser.add_argument(
        "--progress-bar-update-rate", type=int, metavar="HZ", default=3,
        help="how often the line with the position is written on a terminal; 0: never; default: 3",
    )  # fmt: skip
    parser.add_argument(
        "--progress-bar-separation-lines", type=count_or_zero, metavar="N",
        help=f"{IGNORED} the line is the last one",
    )  # fmt: skip


def add_node(parser: Parser) -> None:
    """Add the name of the node, and what it logs."""
    parser.add_argument("--node-name", metavar="NAME", help="the name of the node; default: bag_player")
    parser.add_argument("--log-level", choices=LEVELS, help="what the node logs; default: info")


def defaults() -> dict[str, Any]:
    """Return the value of each option that is not given."""
    parser = Parser()
    add_arguments(parser)
    found: Options = parser.parse_args([""])
    return vars(found)


def run(options: Options) -> int:
    """Play until the end, SIGINT or SIGTERM."""
    from actors.bags.player.errors import InvalidPlayingError
    from actors.bags.recorder.errors import InvalidRecordingError
    from actors.cli.loop import run_async
    from actors.cli.parsing import import_from_working_directory

    import_from_working_directory()
    try:
        selection, chosen = _selection(options), _player_options(options)
    except (InvalidPlayingError, InvalidRecordingError) as error:
        raise CommandError(str(error), USAGE) from None
    run_async(lambda: _play(options, selection, chosen))
    return OK


def _selection(options: Options) -> Selection:
    from actors.bags.recorder.selection import Selection
    from actors.cli.named import absolute

    def names(of: list[str]) -> tuple[str, ...]:
        return tuple(map(absolute, of))

    is_all = not (options.topics or options.services or options.actions or options.regex)
    return Selection(
        topics=names(options.topics),
        services=names(options.services),
        actions=names(options.actions),
        all_topics=is_all,
        all_services=is_all,
        all_actions=is_all,
        regex=options.regex,
        exclude_regex=options.exclude_regex,
        exclude_topics=names(options.exclude_topics),
        exclude_services=names(options.exclude_services),
        exclude_actions=names(options.exclude_actions),
        include_hidden_topics=True,
    )


def _player_options(options: Options) -> PlayerOptions:
    from actors.bags.files import Order
    from actors.bags.player.options import PlayerOptions
    from actors.cli.commands.bag.record import overrides_of
    from actors.cli.named import absolute

    until_ns = options.playback_until_nsec
    if options.playback_until_sec >= 0:
        until_ns = round(options.playback_until_sec * _NS_PER_SEC)
    milliseconds = options.wait_for_all_acked
    return PlayerOptions(
        rate=options.rate,
        loop=options.loop,
        start_paused=options.start_paused,
        start_offset_sec=options.start_offset,
        delay_sec=options.delay,
        duration_sec=None if options.playback_duration < 0 else options.playback_duration,
        until_ns=None if until_ns < 0 else until_ns,
        order=Order.PUBLISH if options.message_order == "sent" else Order.LOG,
        read_ahead=options.read_ahead_queue_size,
        clock_hz=options.clock,
        clock_topics=None if options.clock_topics_all else tuple(map(absolute, options.clock_topics)),
        remappings=dict(map(_rule, options.remap)),
        qos_overrides=overrides_of(options.qos_profile_overrides_path),
        wait_for_all_acked_sec=None if milliseconds is None else milliseconds / 1000,
    )


def _rule(text: str) -> tuple[str, str]:
    from actors.cli.named import absolute

    old, sign, new = text.partition(":=")
    if not (old and sign and new):
        raise CommandError(f"--remap: expected OLD:=NEW, got '{text}'", USAGE)
    return absolute(old), absolute(new)


async def _play(options: Options, selection: Selection, chosen: PlayerOptions) -> None:
    import asyncio
    from dataclasses import asdict

    from actors.bags.player.player import NODE_NAME, Player
    from actors.cli.broker_target import CONNECT_TIMEOUT_SEC, target_of, why_unreachable
    from actors.cli.output import print_json, print_out
    from actors.errors import BrokerUnreachable
    from actors.logging.output import configure_logging
    from actors.logging.severity import severity_from_name

    if options.own_process:
        configure_logging(severity_from_name(options.log_level or "info"))
    target = target_of(options)
    player = Player(
        options.bag_path,
        selection,
        chosen,
        node_name=options.node_name or NODE_NAME,
        url=target.url,
        domain=target.domain,
        connect_timeout_sec=CONNECT_TIMEOUT_SEC,
    )
    begun = False
    try:
        async with player:
            begun = True
            if not options.json:
                print_out(f"Playing {player.path}")
            await _until_end(player, options)
    except BrokerUnreachable:
        if begun:
            raise
        raise await asyncio.to_thread(why_unreachable, target) from None
    finally:
        if begun:
            statistics = player.statistics()
            if options.json:
                print_json(asdict(statistics))
            else:
                print_out(_summary(player, statistics))


async def _until_end(player: Player, options: Options) -> None:
    """Wait for the end of the playing; keys control it meanwhile, and a line shows the position."""
    import asyncio
    import sys

    from proto.aio.tasks import cancel_and_wait

    tasks: list[asyncio.Task[None]] = []
    if not options.disable_keyboard_controls:
        tasks.append(asyncio.create_task(_obey_keys(player)))
    shows = options.progress_bar_update_rate > 0 and not options.json and sys.stderr.isatty()
    if shows:
        tasks.append(asyncio.create_task(_show_progress(player, 1 / options.progress_bar_update_rate)))
    try:
        number: int | None = getattr(options, "num_messages", None)
        if number is not None:
            await player.burst(number)
            if not number:
                player.stop()
        await player.wait()
    finally:
        for task in tasks:
            await cancel_and_wait(task)
        if shows:
            sys.stderr.write(_BACK_AND_CLEAR)
            sys.stderr.flush()


async def _obey_keys(player: Player) -> None:
    from contextlib import aclosing

    from actors.bags.player.errors import InvalidPlayingError
    from actors.cli.keys import keys

    async with aclosing(keys()) as pressed:
        async for key in pressed:
            try:
                if key == " ":
                    player.toggle_paused()
                elif key == "\x1b[C":
                    await player.play_next()
                elif key == "\x1b[A":
                    player.set_rate(player.rate * RATE_STEP)
                elif key == "\x1b[B":
                    player.set_rate(player.rate / RATE_STEP)
            except InvalidPlayingError:
                continue  # the greatest or the least rate: another press changes nothing


async def _show_progress(player: Player, period_sec: float) -> None:
    import asyncio
    import sys

    while True:
        sys.stderr.write(f"{_BACK_AND_CLEAR}{progress_line(player.statistics())}")
        sys.stderr.flush()
        await asyncio.sleep(period_sec)


def progress_line(statistics: PlayingStatistics) -> str:
    """Return the line with the position.

    Args:
        statistics: What the player has done so far.
    """
    position, length = (
        (each - statistics.start_ns) / _NS_PER_SEC for each in (statistics.position_ns, statistics.end_ns)
    )
    paused = ", paused" if statistics.is_paused else ""
    return (
        f"{position:.1f} of {length:.1f} s, rate {statistics.rate:.3g}, {statistics.published:,} messages,"
        f" {statistics.dropped:,} dropped{paused}"
    )


def _summary(player: Player, statistics: PlayingStatistics) -> str:
    from actors.cli.commands.bag.record import summary_of

    missing = {"dropped": statistics.dropped, "invalid": statistics.invalid}
    return summary_of(player.path, statistics.published, statistics.topics, "not played", missing)
