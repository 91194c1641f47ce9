"""Which broker a command talks to, and what to say when there is none."""

from __future__ import annotations

import os
from contextlib import contextmanager
from typing import TYPE_CHECKING, Final

from actors.cli.errors import CommandError
from actors.cli.interrupts import raise_at_once
from actors.config.contexts import DEFAULT, BrokerTarget, UnknownContextError, find_broker_target
from actors.errors import BrokerUnreachable
from actors.session.start_hint import start_hint
from actors.tools.suggestions import did_you_mean
from proto.errors import ProtocolError

if TYPE_CHECKING:
    import argparse
    from collections.abc import Generator

    from actors.graph.inspector import Inspector
    from proto.errors import CallboardError

CONNECT_TIMEOUT_SEC: Final = 2.0
SECOND_LOOK_SEC: Final = 0.5


def target_of(options: argparse.Namespace) -> BrokerTarget:
    """Return where the broker is and which of its graphs is meant: see `actors.config.contexts`.

    Raises:
        InvalidUrlError: The URL cannot be read.
        InvalidEnvironmentError: CALLBOARD_DOMAIN is wrong.
        ContextError: The file of contexts is broken.
        CommandError: There is no such context.
    """
    try:
        return find_broker_target(options.url or None, options.domain, options.context or None)
    except UnknownContextError as error:
        raise unknown_context(error) from error


def unknown_context(error: UnknownContextError) -> CommandError:
    """Return the error that also says which contexts there are."""
    hint = did_you_mean(error.name, error.known) or f"; there is {', '.join(error.known)}"
    return CommandError(f"{error}{hint}")


def set_environment(options: argparse.Namespace) -> None:
    """Give what --url, --domain and --context say to the programs that this process becomes or starts.

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


@contextmanager
def open_inspector(options: argparse.Namespace) -> Generator[Inspector]:
    """Look at the graph that the options name. A signal ends it at once.

    Raises:
        BrokerUnreachable: No broker within 2 s, or it has gone; the text says how to start one, or that
            something else has the port.
    """
    from actors.graph.inspector import Inspector  # noqa: PLC0415 - `--help` needs none

    target = target_of(options)
    raise_at_once()
    inspector = Inspector(target.url, domain=target.domain, timeout_sec=CONNECT_TIMEOUT_SEC)
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


def why_unreachable(target: BrokerTarget) -> CallboardError:
    """Return the error that says why a node has found no broker: there is nothing, or something else."""
    from actors.graph.inspector import Inspector  # noqa: PLC0415 - only in trouble

    inspector = Inspector(target.url, domain=target.domain, timeout_sec=SECOND_LOOK_SEC)
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
    """Say in one line that there is no broker, and what starts one; `error` is of the attempt to connect."""
    source = "" if target.url_from in {"--url", DEFAULT} else f" ({target.url_from})"
    return f"No broker at {', '.join(map(str, target.urls))}{source}. {start_hint(target.urls[0], error)}"
