"""Sinks of loggers: which records they take, and how long they are there."""

from __future__ import annotations

import gc
import logging
import os
import sys
import threading
from typing import TYPE_CHECKING, Any

import pytest

from actors.logging.logger import get_logger
from actors.logging.sinks import add_sink, sinks_of
from tests.seams.nodes import sinks_lock

if TYPE_CHECKING:
    from collections.abc import Iterator
    from types import FrameType


class Sink:
    """Keeps the texts that it takes."""

    def __init__(self, target: str = "") -> None:
        self.target = target
        self.texts: list[str] = []

    def accept(self, record: logging.LogRecord) -> None:
        self.texts.append(record.getMessage())


@pytest.fixture(autouse=True)
def collected() -> Iterator[None]:
    """No sink outlives its test."""
    yield
    gc.collect()
    assert not list(sinks_of("test_sinks"))


def test_the_innermost_takes_a_record() -> None:
    """Loggers below a sink's are its own, unless there is a sink further down; names count whole."""
    outer, inner = Sink(), Sink()
    add_sink("test_sinks", outer)
    remove = add_sink("test_sinks.a.b", inner)
    for name in ("test_sinks", "test_sinks.a", "test_sinks.a.b", "test_sinks.a.b.c", "test_sinks.a.bc"):
        get_logger(name).info(name)
    assert outer.texts == ["test_sinks", "test_sinks.a", "test_sinks.a.bc"]
    assert inner.texts == ["test_sinks.a.b", "test_sinks.a.b.c"]
    remove()
    remove()
    get_logger("test_sinks.a.b").info("moved")
    assert outer.texts[-1] == "moved"


def test_several_of_one_name() -> None:
    """One for each target takes a record: nodes of one name may be in several graphs, or in one."""
    first, same, other = Sink("a"), Sink("a"), Sink("b")
    remove = add_sink("test_sinks", first)
    add_sink("test_sinks", same)
    add_sink("test_sinks", other)
    get_logger("test_sinks").info("x")
    remove()
    get_logger("test_sinks").info("y")
    assert (first.texts, same.texts, other.texts) == (["x"], ["y"], ["x", "y"])


def test_a_removal_hides_no_other_sink() -> None:
    """At no moment: a thread may log while another one removes a sink of the same logger."""
    leaving, staying = Sink("a"), Sink("b")
    remove = add_sink("test_sinks", leaving)
    add_sink("test_sinks", staying)
    seen: list[bool] = []

    def look(frame: FrameType, event: str, argument: object) -> Any:
        del frame, event, argument
        sys.settrace(None)
        seen.append(staying in list(sinks_of("test_sinks")))
        sys.settrace(look)
        return look

    before = sys.gettrace()  # a debugger's
    sys.settrace(look)
    try:
        remove()
    finally:
        sys.settrace(before)
    assert len(seen) > 3
    assert all(seen)


def test_records_below_the_level_and_filtered_ones_are_not_taken() -> None:
    """A sink takes what the logger's level and filters let pass, as handlers do."""
    sink = Sink()
    add_sink("test_sinks", sink)
    logger = get_logger("test_sinks")
    stop = logging.Filter("elsewhere")
    logging.getLogger("callboard.test_sinks").addFilter(stop)
    assert not logger.error("filtered")
    logging.getLogger("callboard.test_sinks").removeFilter(stop)
    logger.debug("below")
    assert logger.info("passed")
    assert sink.texts == ["passed"]


@pytest.mark.skipif(not hasattr(os, "fork"), reason="forks")
@pytest.mark.skipif(sys.version_info >= (3, 12), reason="Python warns of forks beside threads")
def test_a_forked_child_has_none() -> None:
    """A child has no connection, and a lock that another thread held would never be released there."""
    sink = Sink()
    add_sink("test_sinks", sink)
    ready, end = threading.Event(), threading.Event()

    def hold() -> None:
        with sinks_lock():
            ready.set()
            end.wait()

    thread = threading.Thread(target=hold)
    thread.start()
    ready.wait()
    child = os.fork()
    if not child:
        add_sink("other", Sink())()  # takes the lock
        os._exit(len(list(sinks_of("test_sinks"))))
    end.set()
    thread.join()
    assert os.waitpid(child, 0)[1] == 0
