"""`callboard bag play`: publish the messages of a bag."""

from __future__ import annotations

from contextlib import asynccontextmanager
from typing import TYPE_CHECKING, Any, Final

from actors.cli.commands.bag import arguments
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

# Reading arguments needs nothing else.

if TYPE_CHECKING:
    from collections.abc import AsyncGenerator

    from actors.bags.player.options import PlayerOptions
    from actors.bags.player.player import Player, PlayingStatistics
    from actors.bags.selection import Selection

EXAMPLES: Final = {
    "callboard bag play trip": "everything, as fast as it was recorded",
    "callboard bag play trip --rate 2 --loop --clock": "twice as fast, again and again, with simulated time",
    "callboard bag play trip --start-offset 5 --playback-duration 10": "ten seconds of it",
    "callboard bag play trip --topics /imu --remap /imu:=/imu2": "one topic, under another name",
    "callboard bag play trip.mcap --start-paused": "space starts it, the right arrow plays one message",
    "callboard bag play -i lidar -i cameras": "two bags at once, merged by time",
    "callboard bag play trip --publish-service-requests": "recorded requests are sent again",
}
CLOCK_HZ: Final = 40.0
RATE_STEP: Final = 1.1
_NS_PER_SEC: Final = 10**9
_BACK_AND_CLEAR: Final = "\r\x1b[K"


def add_arguments(parser: Parser) -> None:
    """Describe the arguments."""
    arguments.add_bag(parser, nargs="?")
    parser.add_argument(
        "-i", "--input", action="append", nargs="+", metavar=("BAG", "STORAGE"), default=[],
        help="a bag, instead of the argument; with several, they are played at once, merged by time",
    )  # fmt: skip
    arguments.add_storage(parser)
    _add_time(parser)
    add_reading(parser)
    arguments.add_names(parser, "play", exclude_regex=("-x", "--exclude-regex"))
    add_publishing(parser)
    _add_clock(parser)
    _add_requests(parser)
    _add_control(parser)
    arguments.add_node(parser, "bag_player")
    add_json_option(parser, "one document at the end")
    add_broker_options(parser)


def _add_time(parser: Parser) -> None:
    parser.add_argument(
        "-r", "--rate", type=positive, metavar="N", default=1.0,
        help="seconds of the bag to play per second; default: 1",
    )  # fmt: skip
    parser.add_flag("-l", "--loop", help="start again at the end")
    parser.add_argument(
        "-d", "--delay", type=not_negative, metavar="SEC", default=0.0,
        help="wait this long before each pass through the bag",
    )  # fmt: skip
    parser.add_argument(
        "--playback-duration", type=float, metavar="SEC", default=-1.0,
        help="play this many seconds of the bag; negative: all; 0: nothing, as in ROS 2",
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
        help="play messages by the times when they were received (default) or sent",
    )  # fmt: skip


def add_reading(parser: Parser) -> None:
    """Add where reading begins, and how far it is ahead of playing."""
    parser.add_argument(
        "--start-offset", type=not_negative, metavar="SEC", default=0.0,
        help="start this long after the first message",
    )  # fmt: skip
    parser.add_argument(
        "--read-ahead-queue-size", type=count, metavar="N", default=1000,
        help="messages to read before they are due; default: 1000",
    )  # fmt: skip


def add_publishing(parser: Parser) -> None:
    """Add the names and the QoS of the published topics."""
    parser.add_argument(
        "-m", "--remap", nargs="+", metavar="OLD:=NEW", default=[], help="publish topics under other names"
    )
    arguments.add_qos_overrides(
        parser, "the player's publishers, by topic; default: what was offered when it was recorded"
    )


def _add_clock(parser: Parser) -> None:
    clock = parser.add_mutually_exclusive_group()
    clock.add_argument(
        "--clock", type=positive, nargs="?", const=CLOCK_HZ, default=0.0, metavar="HZ",
        help=f"publish the time of the bag on /clock at this rate, also while paused; without a number:"
        f" {CLOCK_HZ:g} Hz",
    )  # fmt: skip
    clock.add_argument(
        "--clock-topics", nargs="+", metavar="TOPIC", default=[],
        help="publish it before each message of these topics",
    )  # fmt: skip
    clock.add_argument("--clock-topics-all", action="store_true", help="publish it before each message")
    parser.add_argument(
        "--wait-for-all-acked", type=count_or_zero, metavar="MS",
        help="at the end, wait up to this long for all messages to reach the broker; 0: no limit",
    )  # fmt: skip
    parser.add_flag("--disable-loan-message", help=f"{IGNORED} messages are not loaned")


def _add_requests(parser: Parser) -> None:
    parser.add_flag(
        "--publish-service-requests",
        help="send recorded requests to their services instead of publishing the service events",
    )
    parser.add_argument(
        "--service-requests-source", choices=("service_introspection", "client_introspection"),
        default="service_introspection",
        help="send the requests that servers received, by their events (default), or those that clients sent",
    )  # fmt: skip


def _add_control(parser: Parser) -> None:
    parser.add_flag("-p", "--start-paused", help="publish nothing until the space key or ~/resume")
    parser.add_flag(
        "--disable-keyboard-controls",
        help="ignore keys; otherwise space pauses, the right arrow plays the next message while paused, and"
        " the arrows up and down change the rate by a tenth",
    )
    parser.add_argument(
        "--progress-bar-update-rate", type=int, metavar="HZ", default=3,
        help="how often to show the position on a terminal; 0: never; default: 3",
    )  # fmt: skip
    parser.add_argument(
        "--progress-bar-separation-lines", type=count_or_zero, metavar="N",
        help=f"{IGNORED} the position is shown in the last line",
    )  # fmt: skip


def defaults() -> dict[str, Any]:
    """Return the value of each option that is not given."""
    parser = Parser()
    add_arguments(parser)
    found: Options = parser.parse_args([""])
    return vars(found)


def run(options: Options) -> int:
    """Play until the end, SIGINT or SIGTERM."""
    from actors.cli.loop import run_async
    from actors.cli.parsing import import_from_working_directory
    from proto.aio import process

    import_from_working_directory()
    options.bags = _bags(options)
    with arguments.usage_errors():
        selection, chosen = _selection(options), _player_options(options)
    run_async(lambda: _play(options, selection, chosen), loop_factory=process.new_event_loop)
    return OK


def _bags(options: Options) -> list[str]:
    if not options.input:
        if options.bag_path is None:
            raise CommandError("Name a bag, or several with -i BAG -i BAG", USAGE)
        return [options.bag_path]
    if options.bag_path is not None:
        raise CommandError(f"Name '{options.bag_path}' with -i, too: only a single bag is an argument", USAGE)
    for bag, *storage in options.input:
        # As in ROS 2, where a second word is the storage.
        if len(storage) > 1 or not set(storage) <= set(arguments.STORAGES):
            raise CommandError(
                f"-i {bag} {' '.join(storage)}: expected a bag, and at most mcap or sqlite3 behind it; name "
                "further bags with another -i",
                USAGE,
            )
    return [bag for bag, *_ in options.input]


def _selection(options: Options) -> Selection:
    is_all = not (options.topics or options.services or options.actions or options.regex)
    return arguments.selection_of(
        options,
        options.topics,
        all_topics=is_all,
        all_services=is_all,
        all_actions=is_all,
        include_hidden_topics=True,  # they would not be in the bag if nobody wanted them
    )


def _player_options(options: Options) -> PlayerOptions:
    from actors.bags.player.options import PlayerOptions
    from actors.bags.player.played_service import RequestsSource
    from actors.bags.storage.bag_file import Order
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
        qos_overrides=arguments.qos_overrides_of(options),
        service_requests=RequestsSource(options.service_requests_source)
        if options.publish_service_requests
        else None,
        wait_for_all_acked_sec=None if milliseconds is None else milliseconds / 1000,
    )


def _rule(text: str) -> tuple[str, str]:
    from actors.cli.named import absolute

    old, sign, new = text.partition(":=")
    if not (old and sign and new):
        raise CommandError(f"--remap: expected OLD:=NEW, got '{text}'", USAGE)
    return absolute(old), absolute(new)


async def _play(options: Options, selection: Selection, chosen: PlayerOptions) -> None:
    import sys
    from contextlib import AsyncExitStack
    from functools import partial

    from actors.bags.player.player import Player
    from actors.cli.commands.bag.running import running
    from actors.cli.keys import handling_keys
    from actors.cli.output import print_out

    async with AsyncExitStack() as stack:
        make = partial(Player, options.bags, selection, chosen)
        summarize = partial(_print_summary, as_json=options.json)
        player = await stack.enter_async_context(running(options, make, summarize))
        if not options.json:
            print_out(f"Playing {_names(player)}")
        if not options.disable_keyboard_controls:
            await stack.enter_async_context(handling_keys(partial(_obey, player)))
        if options.progress_bar_update_rate > 0 and not options.json and sys.stderr.isatty():
            await stack.enter_async_context(_showing_progress(player, 1 / options.progress_bar_update_rate))
        number: int | None = getattr(options, "num_messages", None)  # of `bag burst`
        if number is not None:
            await player.burst(number)
            if not number:
                player.stop()
        await player.wait()


async def _obey(player: Player, key: str) -> None:
    from actors.bags.errors import InvalidBagOptionError

    try:
        if key == " ":
            player.toggle_paused()
        elif key == "\x1b[C":
            await player.play_next()
        elif key == "\x1b[A":
            player.set_rate(player.rate * RATE_STEP)
        elif key == "\x1b[B":
            player.set_rate(player.rate / RATE_STEP)
    except InvalidBagOptionError:
        pass  # the rate is at its limit already, and stays as it is


@asynccontextmanager
async def _showing_progress(player: Player, period_sec: float) -> AsyncGenerator[None]:
    """Show the position in the last line of the terminal, and clear the line at the end."""
    import asyncio
    import logging
    import sys

    from proto.aio.tasks import cancel_and_wait

    def show(text: str) -> None:
        sys.stderr.write(f"{_BACK_AND_CLEAR}{text}")
        sys.stderr.flush()

    async def show_again_and_again() -> None:
        while True:
            show(progress_line(player.statistics()))
            await asyncio.sleep(period_sec)

    def clear(_: object) -> bool:
        # A line of the log takes the place of the position, rather than follow it.
        show("")
        return True

    handlers = logging.getLogger().handlers
    for each in handlers:
        each.addFilter(clear)
    task = asyncio.create_task(show_again_and_again())
    try:
        yield
    finally:
        for each in handlers:
            each.removeFilter(clear)
        await cancel_and_wait(task)
        show("")


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


def _names(player: Player) -> str:
    return ", ".join(map(str, player.paths))


def _print_summary(player: Player, *, as_json: bool) -> None:
    from dataclasses import asdict

    from actors.cli.commands.bag.summaries import summary_of
    from actors.cli.output import print_json, print_out

    found = player.statistics()
    if as_json:
        print_json(asdict(found))
        return
    missing = {
        "dropped": found.dropped,
        "invalid": found.invalid,
        "without a server": found.unserved,
        "failed": found.failed,
    }
    print_out(summary_of(_names(player), found.topics, "not played", missing))
