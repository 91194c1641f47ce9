"""`callboard topic delay`: how old messages are when they come, by the stamp in their header."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, cast

from actors.cli.counters import PRINT_EVERY_SEC
from actors.cli.errors import CommandError
from actors.cli.here import look_here
from actors.cli.listening import MEASURING, Listener, warn_unpublished
from actors.cli.loop import run_async
from actors.cli.output import note, say, say_json
from actors.cli.session import graph_of, session
from actors.cli.topic_hz import SILENCE
from actors.cli.topic_hz_heard import spread
from actors.interfaces.errors import InvalidMessageError
from actors.tools.hearing import decoder_of
from actors.tools.rates import RATE_WINDOW, Delay

if TYPE_CHECKING:
    import argparse
    from collections.abc import Callable

    from actors.endpoints.subscription.backlog import MessageInfo


class Heard:
    """The messages of one topic."""

    def __init__(self, topic: str, window: int | None, decode: Callable[[bytes], Any]) -> None:
        self.topic = topic
        self.delay = Delay(window or RATE_WINDOW)
        self.new = 0
        self._decode = decode

    def take(self, data: bytes, info: MessageInfo) -> None:
        """A message has come.

        Raises:
            CommandError: It has no header, and none before had.
            InvalidMessageError: It is no message, or it alone has no header.
        """
        sent_ns = _stamp_ns(self._decode(data))
        if sent_ns is None:
            if self.delay.summary() is not None:
                raise InvalidMessageError("it has no header")
            text = "msg does not have header: the delay is read from header.stamp, which messages of"
            raise CommandError(f"{text} {self.topic} do not have")
        self.delay.add((info.received_timestamp - sent_ns) / 1e9)
        self.new += 1


def run(options: argparse.Namespace) -> int:
    """Print delays until a signal."""
    look_here()
    run_async(lambda: _hear(options))
    return 0


async def _hear(options: argparse.Namespace) -> None:
    async with session(options) as node:
        topic = node.resolve_topic_name(options.topic)
        snapshot = await graph_of(node)
        warn_unpublished(snapshot, topic)
        heard = Heard(topic, options.window, decoder_of(snapshot, topic))
        with Listener(node, timeout_sec=options.timeout) as listener:
            listener.hear(topic, heard.take, MEASURING)
            async for _ in listener.ticks(PRINT_EVERY_SEC):
                if _show(options, heard) and options.once:
                    return


def _show(options: argparse.Namespace, heard: Heard) -> bool:
    seen, new = heard.delay.summary(), heard.new
    heard.new = 0
    if options.json:
        if seen is not None or not options.once:
            say_json(
                {
                    "topic": heard.topic,
                    "new": new,
                    "window": seen.window if seen else 0,
                    "mean_sec": seen and seen.mean_sec,
                    "min_sec": seen and seen.min_sec,
                    "max_sec": seen and seen.max_sec,
                    "std_dev_sec": seen and seen.deviation_sec,
                }
            )
    elif seen is None or not new:
        note(SILENCE)
    else:
        say(f"average delay: {seen.mean_sec:.3f}\n\t{spread(seen)}")
    return seen is not None


def _stamp_ns(message: Any) -> int | None:
    """Return the time in a message's header; None if it has none."""
    stamp = _field(_field(message, "header"), "stamp")
    sec, nanosec = _field(stamp, "sec"), _field(stamp, "nanosec")
    if isinstance(sec, int) and isinstance(nanosec, int):
        return sec * 1_000_000_000 + nanosec
    return None


def _field(value: Any, name: str) -> Any:
    return cast("dict[str, Any]", value).get(name) if isinstance(value, dict) else getattr(value, name, None)
