"""A node's log on `/rosout`, as another node receives it."""

from __future__ import annotations

import asyncio
import gc
import inspect
import itertools
import logging
import threading
import time
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

import pytest

import actors
from actors import LoggingSeverity
from actors.arguments.ros_arguments import RosArguments, process_arguments
from actors.interfaces.codec import codec_for
from actors.interfaces.rcl_interfaces.msg import Log
from actors.logging.sinks import sinks_of
from actors.node import rosout
from actors.qos.profile import qos_profile_rosout_default
from broker import Broker, BrokerOptions
from tests.actors.meeting import matched, turns, until
from tests.seams.nodes import link_of
from tests.system import move_wall_clock

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from tests.actors.meeting import Meeting

ON: dict[str, Any] = {"enable_rosout": True}
_numbers = itertools.count()


@pytest.fixture
def name() -> Iterator[str]:
    """The name of a node whose logger no other test uses."""
    name = f"rosout_{next(_numbers)}"
    yield name
    actors.get_logger(name).set_level(LoggingSeverity.UNSET)


class Reader:
    """Keeps what arrives on `/rosout`."""

    def __init__(self, node: actors.Node) -> None:
        self.lines: list[Log] = []
        self.subscription = node.create_subscription(
            Log, "/rosout", self.lines.append, qos_profile_rosout_default
        )

    @property
    def texts(self) -> list[str]:
        return [line.msg for line in self.lines]


@pytest.fixture
async def reader(meeting: Meeting) -> Reader:
    return Reader(await meeting.node("reader"))


def publisher(node: actors.Node) -> Any:
    """The diagnostics of a node's publisher of its log."""
    (found,) = [each for each in node.diagnostics().publishers if each.topic == "/rosout"]
    return found


async def test_a_line(meeting: Meeting, reader: Reader, name: str) -> None:
    """A line has its level, logger, text, place in the code, and the time of the log call."""
    node = await meeting.node(name, namespace="ns", **ON)
    before = time.time_ns()
    frame = inspect.currentframe()
    assert node.get_logger().warning("Battery low")
    assert frame is not None
    number = frame.f_lineno - 2
    after = time.time_ns()
    await until(lambda: reader.lines)
    (line,) = reader.lines
    assert (line.level, line.name, line.msg) == (Log.WARN, f"ns.{name}", "Battery low")
    assert (line.file, line.function, line.line) == (__file__, "test_a_line", number)
    assert before <= line.stamp.sec * 1_000_000_000 + line.stamp.nanosec <= after


async def test_levels(meeting: Meeting, reader: Reader, name: str) -> None:
    """Only what the logger's level lets pass is published, with ROS 2's numbers, in order."""
    log = (await meeting.node(name, **ON)).get_logger()
    for level in (LoggingSeverity.ERROR, LoggingSeverity.DEBUG):
        log.set_level(level)
        for severity in LoggingSeverity:
            log.log("text", severity)
    await until(lambda: len(reader.lines) == 7)
    assert [line.level for line in reader.lines] == [40, 50, 10, 20, 30, 40, 50]


async def test_children(meeting: Meeting, reader: Reader, name: str) -> None:
    """Lines of child loggers have their names; a node below takes its own, and other loggers have no node."""
    outer = await meeting.node(name, **ON)
    inner = await meeting.node("inner", namespace=name, **ON)
    outer.get_logger().get_child("arm").get_child("left").info("child")
    inner.get_logger().get_child("x").info("inner")
    actors.get_logger(f"{name}x").info("nobody's")
    await until(lambda: len(reader.lines) == 2)
    await meeting.settled(outer, inner)
    assert sorted((line.name, line.msg) for line in reader.lines) == [
        (f"{name}.arm.left", "child"),
        (f"{name}.inner.x", "inner"),
    ]
    assert publisher(outer).published == publisher(inner).published == 1


async def test_a_node_below_without_it(meeting: Meeting, reader: Reader, name: str) -> None:
    """What a node does not publish is not published by the node whose name its namespace is either."""
    node = await meeting.node(name, **ON)
    below = await meeting.node("below", namespace=name, enable_rosout=False)
    below.get_logger().info("secret")
    below.get_logger().get_child("part").info("secret")
    node.get_logger().info("public")
    await until(lambda: reader.lines)
    assert reader.texts == ["public"]


async def test_filters(meeting: Meeting, reader: Reader, name: str) -> None:
    """What a log call's own filters or a filter of the logger stop is not published."""
    node = await meeting.node(name, **ON)
    secret = logging.Filter()
    secret.filter = lambda record: "secret" not in record.getMessage()  # type: ignore[method-assign]
    standard = logging.getLogger(f"callboard.{name}")
    standard.addFilter(secret)
    for number in range(3):
        node.get_logger().info(f"once {number}", once=True)
    assert not node.get_logger().info("a secret")
    node.get_logger().info("last")
    await until(lambda: len(reader.lines) == 2)
    assert reader.texts == ["once 0", "last"]
    standard.removeFilter(secret)


async def test_an_exception_is_below_its_line(meeting: Meeting, reader: Reader, name: str) -> None:
    """The log of a callback that raises has its traceback."""
    node = await meeting.node(name, **ON)
    node.create_timer(0, lambda: 1 // 0)
    await until(lambda: reader.lines)
    assert reader.lines[0].msg.splitlines()[1] == "Traceback (most recent call last):"
    assert reader.lines[0].msg.endswith("ZeroDivisionError: integer division or modulo by zero")


async def test_threads(meeting: Meeting, reader: Reader, name: str) -> None:
    """Lines of several threads all arrive, each thread's in its order."""
    node = await meeting.node(name, **ON)
    await matched(reader.subscription)

    def work(thread: int) -> None:
        for number in range(200):
            node.get_logger().info(f"{thread} {number}")

    await asyncio.gather(*(asyncio.to_thread(work, thread) for thread in range(4)))
    await until(lambda: len(reader.lines) == 800)
    for thread in range(4):
        mine = [text for text in reader.texts if text.startswith(f"{thread} ")]
        assert mine == [f"{thread} {number}" for number in range(200)]


async def test_one_wake_up_for_a_burst(
    meeting: Meeting, reader: Reader, name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """However many lines a thread logs while the loop is busy, it wakes the loop once."""
    node = await meeting.node(name, **ON)
    await until(lambda: publisher(node).matched)
    loop, calls = asyncio.get_running_loop(), list[object]()

    def wake(*args: Any) -> None:
        calls.append(args)
        loop.call_soon_threadsafe(*args)

    with monkeypatch.context() as patch:
        patch.setattr(
            link_of(node), "loop", SimpleNamespace(
                is_closed=lambda: False,
                call_soon=loop.call_soon,
                call_soon_threadsafe=wake,
            ),
        )  # fmt: skip
        thread = threading.Thread(target=lambda: [node.get_logger().info("x") for _ in range(500)])
        thread.start()
        thread.join()
    await until(lambda: len(reader.lines) == 500)
    assert len(calls) == 1


async def test_a_burst_arrives_whole(meeting: Meeting, reader: Reader, name: str) -> None:
    """A callback that logs several thousand lines loses none: the broker takes them as they come."""
    node = await meeting.node(name, **ON)
    for number in range(3000):
        node.get_logger().info(str(number))
    await meeting.settled(node)
    found = publisher(node)
    assert (found.published, found.dropped, found.queued) == (3000, 0, 0)


@pytest.mark.parametrize(("limit", "most"), [("MAX_LINES", 10), ("MAX_WAITING_CHARACTERS", 21)])
async def test_overflow_is_counted(
    meeting: Meeting, reader: Reader, name: str, monkeypatch: pytest.MonkeyPatch, limit: str, most: int
) -> None:
    """Beyond the limits of one loop turn the oldest lines are dropped, and diagnostics say how many."""
    monkeypatch.setattr(rosout, limit, most)
    node = await meeting.node(name, **ON)
    for turn in (1, 2):
        for number in range(25):
            node.get_logger().info(f"{number:02}")
        found = publisher(node)
        assert (found.published, found.dropped, found.queued) == (25 * turn, 15 * turn, 10)
        await until(lambda: len(reader.lines) == 10)
        assert reader.texts == [str(number) for number in range(15, 25)]
        reader.lines.clear()
        found = publisher(node)
        assert (found.published, found.dropped, found.queued) == (25 * turn, 15 * turn, 0)


async def test_without_a_broker_the_newest_are_kept(name: str) -> None:
    """A node that finds no broker keeps as many lines as the topic's depth, and counts the rest."""
    async with actors.Node(name, url="callboard://127.0.0.1:1", use_global_arguments=False) as node:
        node.get_logger().set_level(LoggingSeverity.INFO)
        before = publisher(node).published
        for number in range(1500):
            node.get_logger().info(str(number))
        await until(lambda: publisher(node).queued == 1000)
        found = publisher(node)
        assert (found.published, found.dropped) == (before + 1500, before + 500)


async def test_while_nobody_subscribes(meeting: Meeting, name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """The first line leaves at once, those of the next moment together; whoever joins gets them at once."""
    monkeypatch.setattr(rosout, "QUIET_SEC", 3600.0)
    node = await meeting.node(name, **ON)
    await meeting.settled(node)
    node.get_logger().info("left")
    await turns()
    assert publisher(node).queued == 0
    for number in range(20):
        node.get_logger().info(str(number))
        await turns()
    assert publisher(node).queued == 20
    late = Reader(await meeting.node("late"))
    await until(lambda: len(late.lines) == 21)
    assert late.texts == ["left", *map(str, range(20))]
    late.subscription.destroy()
    await until(lambda: not publisher(node).matched)
    for number in range(2 * rosout.QUIET_LINES):
        node.get_logger().info(str(number))
        await turns(1)
    await until(lambda: not publisher(node).queued)


async def test_late_joiners_get_earlier_lines(meeting: Meeting, name: str) -> None:
    """A subscription that comes later gets what was logged before, also before the node was connected."""
    node = meeting.absent(name, **ON)
    node.get_logger().info("made")
    async with node:
        node.get_logger().info("entered")
        await meeting.settled(node)
        late = Reader(await meeting.node("late"))
        await until(lambda: len(late.lines) == 2)
        node.get_logger().info("later")
        await until(lambda: len(late.lines) == 3)
    assert late.texts == ["made", "entered", "later"]


async def test_old_lines_expire(
    meeting: Meeting, reader: Reader, name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Nobody takes lines that were published more than ten seconds ago, and the broker keeps none of them."""
    node = await meeting.node(name, **ON)
    await until(lambda: publisher(node).matched)
    with monkeypatch.context() as patch:
        move_wall_clock(patch, -10.1)
        node.get_logger().info("old")
        link_of(node).flush()
    node.get_logger().info("new")
    await until(lambda: reader.texts == ["new"])
    late = Reader(await meeting.node("late"))
    await until(lambda: late.lines)
    assert (late.texts, late.subscription.expired, reader.subscription.expired) == (["new"], 0, 1)


async def test_after_a_reconnect(meeting: Meeting, reader: Reader, name: str) -> None:
    """What is logged without a link reaches the next broker, and late joiners there get earlier lines."""
    node = await meeting.node(name, **ON)
    node.get_logger().info("before")
    await until(lambda: reader.lines)
    await meeting.stop_broker()
    await until(lambda: not node.connected)
    node.get_logger().info("meanwhile")
    await meeting.restart_broker()
    await until(lambda: "meanwhile" in reader.texts)
    late = Reader(await meeting.node("late"))
    await until(lambda: "meanwhile" in late.texts)
    for each in (reader, late):
        assert [text for text in each.texts if text in {"before", "meanwhile"}] == ["before", "meanwhile"]


async def test_the_last_lines_are_sent(meeting: Meeting, reader: Reader, name: str) -> None:
    """Lines logged just before a node leaves arrive; afterwards its logger has no topic."""
    async with meeting.absent(name, **ON) as node:
        for number in range(100):
            node.get_logger().info(str(number))
    assert list(sinks_of(name)) == []
    actors.get_logger(name).info("after the end")
    await until(lambda: len(reader.lines) == 100)
    assert reader.texts == [str(number) for number in range(100)]


async def test_lines_that_were_never_sent_cause_no_warning(
    name: str, caplog: pytest.LogCaptureFixture
) -> None:
    """They were printed. The debug log says how many; messages of the user's publishers are warned of."""
    actors.get_logger(name).set_level(LoggingSeverity.DEBUG)
    async with actors.Node(name, url="callboard://127.0.0.1:1", use_global_arguments=False) as node:
        node.get_logger().info("one")
        node.create_publisher(Log, "own").publish(Log())
    never = [(each.levelname, each.getMessage()) for each in caplog.records if "never sent" in each.msg]
    assert never[0][0] == "WARNING"
    assert never[0][1].startswith("1 published messages were never sent: no link to a broker at")
    assert never[1][0] == "DEBUG"
    assert "log lines and parameter events were never sent: no link" in never[1][1]


async def test_a_broker_may_refuse_it(tmp_path: Path, name: str, caplog: pytest.LogCaptureFixture) -> None:
    """Without the right there is one line for debugging, which is not published itself; drops are counted."""
    rules = tmp_path / "access.toml"
    rules.write_text(
        '[local]\nuser = "guest"\n[users.guest]\nroles = ["guest"]\n[roles.guest]\nallow.node = ["/**"]\n'
    )
    async with Broker(BrokerOptions(port=0, auth=rules)) as broker:
        node = actors.Node(
            name, url=broker.url, use_global_arguments=False, start_parameter_services=False,
            parameter_overrides={"start_type_description_service": False}, start_diagnostics_service=False,
        )  # fmt: skip
        node.get_logger().set_level(LoggingSeverity.DEBUG)
        with caplog.at_level(logging.DEBUG):
            async with node:
                node.get_logger().info("before the answer")
                await node.get_graph()
                node.get_logger().info("after it")
                await turns()
                found = publisher(node)
    lines = [each.getMessage() for each in caplog.records if each.name == f"callboard.{name}"]
    assert sum("refused a standard publisher" in line for line in lines) == 1
    assert (found.published, found.dropped, found.queued) == (2, 2, 0)


async def test_publishing_logs_nothing_to_itself(
    meeting: Meeting, reader: Reader, name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A line that is logged while lines are published is printed only: there is no recursion."""
    node = await meeting.node(name, **ON)
    encode, log = codec_for(Log).encode, node.get_logger()

    def encode_and_log(line: Log) -> bytes:
        assert log.warning("the queue of /rosout is full")
        return encode(line)

    monkeypatch.setattr(rosout, "_codec", SimpleNamespace(encode=encode_and_log))
    log.info("one")
    await until(lambda: reader.lines)
    log.info("two")
    await until(lambda: len(reader.lines) == 2)
    await meeting.settled(node)
    assert reader.texts == ["one", "two"]
    assert publisher(node).published == 2


async def test_texts_of_any_size_and_kind(meeting: Meeting, reader: Reader, name: str) -> None:
    """A long line is cut, and text that UTF-8 cannot encode is escaped; neither is an error."""
    log = (await meeting.node(name, **ON)).get_logger()
    logging.getLogger(f"callboard.{name}").addHandler(logging.NullHandler())  # not to the report
    logging.getLogger(f"callboard.{name}").propagate = False
    log.info("x" * 1_000_000)
    log.info("a\ud800\x00é")
    log.get_child("c" * 5000).info("child")
    await until(lambda: len(reader.lines) == 3)
    assert reader.texts[0].endswith("x… and 983616 more characters")
    assert len(reader.texts[0]) < rosout.MAX_CHARACTERS + 50
    assert reader.texts[1] == "a\\ud800\x00é"
    assert len(reader.lines[2].name) < rosout.MAX_NAME + 50


async def test_a_thread_may_log_while_the_node_ends(
    meeting: Meeting, reader: Reader, name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A line that comes after the last were sent is counted, not published by a publisher that is gone."""
    node = await meeting.node(name, **ON)
    await until(lambda: publisher(node).matched)
    (sink,) = sinks_of(name)
    assert isinstance(sink, rosout.Rosout)
    node.get_logger().info("sent")
    record = logging.getLogger(f"callboard.{name}").makeRecord(name, 20, __file__, 1, "too late", (), None)
    encode = codec_for(Log).encode

    def encode_meanwhile(line: Log) -> bytes:
        thread = threading.Thread(target=sink.accept, args=(record,))
        thread.start()
        thread.join()
        return encode(line)

    monkeypatch.setattr(rosout, "_codec", SimpleNamespace(encode=encode_meanwhile))
    sink.destroy()
    await until(lambda: sink.diagnostics().dropped == 1)
    sink.accept(record)
    await meeting.settled(node)
    found = sink.diagnostics()
    assert (found.published, found.dropped, found.queued) == (3, 2, 0)
    assert reader.texts == ["sent"]
    assert node.diagnostics().connections == 1


async def test_a_line_that_cannot_be_encoded_is_counted(
    meeting: Meeting, reader: Reader, name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """ROS's stamps end in 2038: with such a clock lines are printed only."""
    node = await meeting.node(name, **ON)
    with monkeypatch.context() as patch:
        move_wall_clock(patch, 2**31)
        node.get_logger().info("later")
    node.get_logger().info("now")
    await until(lambda: reader.lines)
    assert reader.texts == ["now"]
    found = publisher(node)
    assert (found.published, found.dropped, found.queued) == (2, 1, 0)


def test_after_the_loop_is_closed(name: str) -> None:
    """Logging goes on without an error, also if the loop is closed just when a thread logs."""
    node = actors.Node(name)
    loop = asyncio.new_event_loop()
    loop.close()
    link_of(node).loop = loop
    assert node.get_logger().info("closed")
    closing: Any = SimpleNamespace(is_closed=lambda: False, call_soon_threadsafe=loop.call_soon_threadsafe)
    link_of(node).loop = closing
    assert node.get_logger().info("closed just now")
    link_of(node).loop = None
    assert publisher(node).queued == 2
    node.destroy_node()


@pytest.mark.parametrize(
    ("options", "flags", "published"),
    [
        ({}, RosArguments(), True),
        ({"enable_rosout": False}, RosArguments(), False),
        ({"cli_args": ["--ros-args", "--disable-rosout-logs"]}, RosArguments(), False),
        ({}, RosArguments(rosout_logs=False), False),
        ({"use_global_arguments": False}, RosArguments(rosout_logs=False), True),
        ({"cli_args": ["--ros-args", "--disable-stdout-logs"]}, RosArguments(stdout_logs=False), True),
    ],
)
def test_switches(name: str, options: dict[str, Any], flags: RosArguments, published: bool) -> None:
    """`enable_rosout` and `--disable-rosout-logs` of the process or the node turn it off."""
    token = process_arguments.set(flags)
    try:
        node = actors.Node(name, **options)
    finally:
        process_arguments.reset(token)
    assert [each.topic for each in node.diagnostics().publishers].count("/rosout") == published
    assert [each.target is not None for each in sinks_of(name)] == [published]
    node.destroy_node()
    assert not any(each.target for each in sinks_of(name))


async def test_nodes_of_one_name(meeting: Meeting, reader: Reader, name: str) -> None:
    """They have one logger, and publish each line once; when one of them leaves, the other goes on."""
    first = await meeting.node(name, shared_name=True, **ON)
    await meeting.node(name, shared_name=True, **ON)
    actors.get_logger(name).info("both")
    first.destroy_node()
    await until(lambda: len(list(sinks_of(name))) == 1 and not first.connected)
    actors.get_logger(name).info("second")
    await until(lambda: reader.texts[-1:] == ["second"])
    assert reader.texts == ["both", "second"]


async def test_it_can_be_remapped(meeting: Meeting, name: str) -> None:
    """The topic has ROS 2's QoS, and a rule may give it another name."""
    node = await meeting.node(name, cli_args=["--ros-args", "-r", "/rosout:=log"], **ON)
    (info,) = await node.get_publishers_info_by_topic("/log")
    assert info.topic_type == "rcl_interfaces/msg/Log"
    assert info.qos_profile == qos_profile_rosout_default
    assert meeting.broker.stats().definitions == 0


def test_a_node_that_never_runs_is_collected(name: str) -> None:
    """A logger keeps no node alive."""
    node = actors.Node(name)
    assert len(list(sinks_of(name))) == 1
    node.get_logger().info("kept")
    del node
    gc.collect()
    assert not list(sinks_of(name))
