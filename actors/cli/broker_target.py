"""The broker that a command talks to, and the errors if none answers."""

from __future__ import annotations

import os
from contextlib import AsyncExitStack, asynccontextmanager, contextmanager
from typing import TYPE_CHECKING, Final, TypeVar

from actors.cli.errors import CommandError
from actors.cli.interrupts import raise_at_once
from actors.cli.output import print_warning
from actors.config.context_errors import UnknownContextError
from actors.config.contexts import DEFAULT, BrokerTarget, find_broker_target, warn_of_ros_domain
from actors.errors import BrokerUnreachable
from actors.session.start_hint import start_hint
from actors.tools.suggestions import did_you_mean
from proto.errors import ProtocolError

if TYPE_CHECKING:
    import argparse
    from collections.abc import AsyncGenerator, Generator
    from contextlib import AbstractAsyncContextManager

    from actors.graph.inspector import Inspector
    from proto.errors import CallboardError

T = TypeVar("T")

CONNECT_TIMEOUT_SEC: Final = 2.0
DIAGNOSIS_SEC: Final = 0.5


def target_of(options: argparse.Namespace, *, knows_ros: bool = False) -> BrokerTarget:
    """Return the broker and domain that the options choose; see `actors.config.contexts`.

    Args:
        options: The command line.
        knows_ros: Whether the command uses ROS_DOMAIN_ID for something else, so that it needs no warning.

    Raises:
        InvalidUrlError: The URL is invalid.
        InvalidEnvironmentError: CALLBOARD_DOMAIN is invalid.
        ContextError: The file of contexts is broken.
        CommandError: There is no such context.
    """
    try:
        target = find_broker_target(options.url or None, options.domain, options.context or None)
    except UnknownContextError as error:
        raise unknown_context(error) from error
    if not knows_ros:
        warn_of_ros_domain(target, print_warning)
    return target


def unknown_context(error: UnknownContextError) -> CommandError:
    """Return the error with the known contexts."""
    hint = did_you_mean(error.name, error.known) or f"; there is {', '.join(error.known)}"
    return CommandError(f"{error}{hint}")


def set_environment(options: argparse.Namespace) -> None:
    """Pass --url, --domain and --context on to programs that this process becomes or starts.

    Raises:
        As `target_of`.
    """
    if options.url is None and options.domain is None and options.context is None:
        return
    target = target_of(options)
    if options.url is not None or options.context is not None:
        os.environ["CALLBOARD_URL"] = target.url
    if options.domain is not None or options.context is not None:
        os.environ["CALLBOARD_DOMAIN"] = str(target.domain)
    if options.context is not None:
        # Only with --context: the program itself finds a context that the environment or the file selects.
        os.environ.update(target.credentials.variables())


@contextmanager
def open_inspector(options: argparse.Namespace) -> Generator[Inspector]:
    """Connect an inspector to the broker that the options choose. A signal raises at once.

    Raises:
        BrokerUnreachable: No broker answered within 2 s, or the link broke; the text says how to start
            one, or that another program has the port.
    """
    from actors.graph.inspector import inspector_for  # noqa: PLC0415 - `--help` needs none

    target = target_of(options)
    # An inspector blocks, so there is no loop in which a recorded signal would be seen.
    raise_at_once()
    inspector = inspector_for(target, CONNECT_TIMEOUT_SEC)
    try:
        inspector.connect()
    except BrokerUnreachable:
        if inspector.listening is not None:
            raise
        raise BrokerUnreachable(missing_broker(target, inspector.error)) from None
    try:
        with inspector:
            yield inspector
    except BrokerUnreachable as error:
        raise BrokerUnreachable(f"{error}. {start_hint(inspector.url)}") from None


@asynccontextmanager
async def connected(entering: AbstractAsyncContextManager[T], target: BrokerTarget) -> AsyncGenerator[T]:
    """Enter something that connects a node of its own to a broker; leave it at the end.

    Args:
        entering: A node, or what has one.
        target: Its broker.

    Raises:
        BrokerUnreachable: No broker answered; the text says how to start one, or that another program has the
            port.
        ProtocolError: Another protocol is spoken there.
    """
    import asyncio  # noqa: PLC0415 - an inspector needs none

    async with AsyncExitStack() as stack:
        try:
            entered = await stack.enter_async_context(entering)
        except BrokerUnreachable:
            raise await asyncio.to_thread(why_unreachable, target) from None
        yield entered


def why_unreachable(target: BrokerTarget) -> CallboardError:
    """Return the error that says why a node found no broker: nothing listens, or another program."""
    from actors.graph.inspector import inspector_for  # noqa: PLC0415 - only after a failure

    inspector = inspector_for(target, DIAGNOSIS_SEC)
    try:
        inspector.connect()
    except ProtocolError as error:
        return error
    except BrokerUnreachable as error:
        if inspector.listening is not None:
            return error
    inspector.close()
    return BrokerUnreachable(missing_broker(target, inspector.error))


def missing_broker(target: BrokerTarget, error: OSError | None = None) -> str:
    """Return the text of the error that no broker answers; `error` is of the attempt to connect."""
    source = "" if target.url_from in {"--url", DEFAULT} else f" ({target.url_from})"
    return f"No broker at {', '.join(map(str, target.urls))}{source}. {start_hint(target.urls[0], error)}"
