"""`callboard topic hz`, `bw` and `delay`."""

from __future__ import annotations

import argparse
import asyncio
import json
import math
import re
import socket
from typing import TYPE_CHECKING, Any

import pytest

from actors.cli.broker_counters import ReportReader, WatchedTopic, ticks
from actors.cli.broker_target import open_inspector
from actors.cli.commands.topic.bw import shown_bytes
from actors.cli.commands.topic.hz import print_counted, print_received
from actors.cli.measuring import RateMeter
from actors.endpoints.endpoint import endpoint_of
from actors.errors import BrokerUnreachable
from actors.graph.broker_report import BrokerReport
from actors.graph.inspector import Inspector
from actors.interfaces.builtin_interfaces.msg import Time
from actors.interfaces.codec import codec_for
from actors.interfaces.rosgraph_msgs.msg import Clock
from actors.interfaces.sensor_msgs.msg import Imu
from actors.interfaces.std_msgs.msg import String
from broker import Broker, BrokerOptions
from proto.wire.stats import BrokerStats, TopicStats
from tests.ports import held_port
from tests.waiting import until

if TYPE_CHECKING:
    from collections.abc import Callable

    import actors
    from tests.actors.cli.conftest import Desk

PATIENCE = ("--once", "--timeout", "30")
NUMBER = r"\d+\.\d{3}"
SPREAD = rf"min: {NUMBER}s max: {NUMBER}s std dev: \d+\.\d{{5}}s window: \d+"


def without_silence(err: str) -> str:
    """Return lines of stderr without those for a second in which a busy machine has published nothing."""
    return err.replace("no new messages\n", "")


@pytest.fixture
def desk(desk: Desk, monkeypatch: pytest.MonkeyPatch) -> Desk:
    """Commands that print twenty times a second, so that no test waits for seconds."""
    for module in ("broker_counters", "measuring"):
        monkeypatch.setattr(f"actors.cli.{module}.PRINT_EVERY_SEC", 0.05)
    return desk


def speaking(node: actors.Node, *topics: str, message: Any = None) -> None:
    """Publish a hundred times a second, on all topics at once: `--once` prints what it knows first."""
    said = String(data="hello") if message is None else message
    publishers = [node.create_publisher(type(said), each, 10) for each in topics or ("said",)]

    def speak() -> None:
        for each in publishers:
            each.publish(said)

    node.create_timer(0.01, speak)


async def test_messages_from_beyond_a_bridge_are_subscribed_to(desk: Desk) -> None:
    """A bridge brings them only if somebody subscribes: the broker has nothing to count."""
    async with desk.node() as gateway:
        mirror = gateway.create_bare_node("robot", labels={"origin": "ros2/7"})
        publisher = mirror.create_publisher(String, "/said", 10)

        def tell() -> None:
            if publisher.get_subscription_count():
                publisher.publish(String(data="hello"))

        gateway.create_timer(0.01, tell)
        await gateway.get_graph()
        measured = (await desk.callboard("topic", "bw", "/said", "--json", *PATIENCE)).json
    assert measured["min_bytes"] > 0


class FakeBroker:
    """A broker's numbers and a clock, for one topic with steady publishers."""

    def __init__(self, hertz: float, *, report_sec: float = 0.001) -> None:
        self.now = 50.0
        self._hertz = hertz
        self._report_sec = report_sec

    def report(self) -> BrokerReport:
        """Take some time to say what was reported since the beginning."""
        self.now += self._report_sec
        said = int((self.now - 20.013) * self._hertz)
        numbers = {"messages": said, "bytes": 10 * said, "publishers": 1}
        topic = TopicStats(0, "/said", **dict.fromkeys(TopicStats._fields[2:], 0) | numbers)
        return BrokerReport(totals=BrokerStats(stamp_sec=self.now), topics={"/said": topic}, links={})

    def pause(self, seconds: float) -> None:
        """Let time go by."""
        self.now += seconds


@pytest.mark.parametrize(("hertz", "report_sec"), [(1.0, 0.001), (40.0, 0.001), (1.0, 0.002), (40.0, 0.1)])
def test_counters_are_exact_soon(hertz: float, report_sec: float) -> None:
    """Ten seconds give the rate within one percent; a slow broker is asked less often, and not less right."""
    broker = FakeBroker(hertz, report_sec=report_sec)
    said = WatchedTopic("/said", 10_000)
    began, shown = broker.now, ticks(broker.report, [said], clock=lambda: broker.now, pause=broker.pause)
    for second in range(1, 11):
        next(shown)
        assert broker.now - began == pytest.approx(second, abs=0.1 + 15 * report_sec)
    found = said.counter.rate()
    assert found is not None
    assert found.per_sec == pytest.approx(hertz, rel=0.01)
    assert said.new == pytest.approx(hertz * (broker.now - began), abs=2 + hertz * report_sec)


async def test_hz_by_counters(desk: Desk, capsys: pytest.CaptureFixture[str]) -> None:
    """Nobody subscribes; the rate and its window, a row for each of several topics; gaps are unknown."""
    lines: list[str] = []

    def has_printed_all() -> bool:
        lines.extend(capsys.readouterr().out.splitlines())
        rated = [line for line in lines if '"rate": null' not in line]
        return all(any(line.startswith(each) for line in rated) for each in ("average", "{", "/other"))

    async with desk.node() as node:
        speaking(node)
        speaking(node, "other")
        await node.get_graph()
        commands = [
            desk.start("topic", "hz", "said", *options, "--timeout", "3")
            for options in ((), ("--json",), ("other",))
        ]
        await until(has_printed_all)
        assert (await node.get_broker_stats()).totals.routed == 0
    ends = [await each for each in commands]
    assert [each.code for each in ends] == [124] * 3  # the topics are silent now
    lines += "".join(each.out for each in ends).splitlines()
    assert any(re.fullmatch(rf"average rate: {NUMBER}", line) for line in lines)
    assert any(re.fullmatch(r"\twindow: \d+", line) for line in lines)
    document = json.loads(next(line for line in lines if line.startswith("{") and '"rate": null' not in line))
    assert document["topic"] == "/said"
    assert document["rate"] > 1
    assert set(document) == {"topic", "rate", "new", "window"}
    row = next(line for line in lines if line.startswith("/other"))
    assert row.split()[2:5] == ["-", "-", "-"]


async def test_one_measurement_is_of_received_messages(desk: Desk) -> None:
    """--once has the exact rate of a slow topic, where a second of counters would be a few tenths off."""
    async with desk.node() as node:
        publisher = node.create_publisher(String, "said", 10)
        node.create_timer(0.1, lambda: publisher.publish(String()))
        await node.get_graph()
        document = (await desk.callboard("topic", "hz", "/said", *PATIENCE, "--json")).json
    # Of one gap the three are the same, but for the rounding of 1 / (1 / x).
    assert document["min_sec"] * document["rate"] < 1 + 1e-9
    assert document["max_sec"] * document["rate"] > 1 - 1e-9


async def test_hz_by_subscription(desk: Desk) -> None:
    """ROS 2's two lines."""
    async with desk.node() as node:
        speaking(node)
        await node.get_graph()
        ended = await desk.callboard("topic", "hz", "said", "--subscribe", *PATIENCE)
        document = (await desk.callboard("topic", "hz", "/said", "--subscribe", *PATIENCE, "--json")).json
    assert (ended.code, without_silence(ended.err)) == (0, "")
    assert re.fullmatch(rf"average rate: {NUMBER}\n\t{SPREAD}\n", ended.out)
    assert document["min_sec"] <= document["max_sec"]
    assert set(document) == {"topic", "rate", "new", "window", "min_sec", "max_sec", "std_dev_sec"}


async def test_hz_of_several_topics_is_a_table(desk: Desk) -> None:
    """ROS 2's header and rule, a row for each topic with a rate."""
    async with desk.node() as node:
        speaking(node, "a", "a_longer_name")
        await node.get_graph()
        ended = await desk.callboard("topic", "hz", "a", "a_longer_name", "a", *PATIENCE)
    lines = ended.out.splitlines()
    assert lines[:2] == ["Subscribed to [/a]", "Subscribed to [/a_longer_name]"]
    lines = lines[2:]
    assert lines[0].split() == ["topic", "rate", "min_delta", "max_delta", "std_dev", "window"]
    assert lines[1] == "=" * len(lines[0])
    assert [line.split()[0] for line in lines[2:-1]] == ["/a", "/a_longer_name"]
    assert {len(line) for line in lines[:-1]} == {len(lines[0])}


async def test_hz_of_some_messages(desk: Desk) -> None:
    """A filter chooses; it subscribes by itself, and its mistakes are reported."""
    async with desk.node() as node:
        speaking(node)
        await node.get_graph()
        ended = await desk.callboard("topic", "hz", "said", "--filter", "m.data == 'hello'", *PATIENCE)
        nothing = await desk.callboard("topic", "hz", "said", "--filter", "m.data.nothing", *PATIENCE)
    assert re.search(SPREAD, ended.out)
    assert (nothing.code, nothing.out) == (1, "")
    assert "AttributeError" in nothing.err


@pytest.mark.parametrize("verb", ["hz", "bw"])
@pytest.mark.parametrize("options", [(), ("--subscribe",)])
async def test_a_topic_without_messages(desk: Desk, verb: str, options: tuple[str, ...]) -> None:
    """A warning with what may be meant, ROS 2's text once a second, and 124 after the timeout."""
    async with desk.node() as node:
        node.create_publisher(String, "addison", 10)
        await node.get_graph()
        ended = await desk.callboard("topic", verb, "/adison", *options, "--timeout", "0.15", "--json")
        quiet = await desk.callboard("topic", verb, "/addison", *options, "--timeout", "0.3")
    assert ended.code == quiet.code == 124
    assert ended.err.startswith(
        "WARNING: topic [/adison] does not appear to be published yet; did you mean '/addison'?\n"
    )
    assert quiet.err.startswith("no new messages\n")
    assert quiet.err.endswith("No message on /addison within 0.3 s\n")
    assert all(document["topic"] == "/adison" for document in ended.documents)


async def test_bw_by_counters(desk: Desk) -> None:
    """Bytes a second and the mean."""
    async with desk.node() as node:
        speaking(node)
        await node.get_graph()
        ended = await desk.callboard("topic", "bw", "said", *PATIENCE)
        document = (await desk.callboard("topic", "bw", "said", *PATIENCE, "--json")).json
    assert (ended.code, without_silence(ended.err)) == (0, "")
    assert re.fullmatch(r"\d+(\.\d\d)? K?B/s from \d+ messages\n\tMessage size mean: 12 B\n", ended.out), (
        ended.out
    )
    assert document["mean_bytes"] == 12
    assert set(document) == {"topic", "bytes_per_sec", "messages", "mean_bytes"}


async def test_bw_by_subscription(desk: Desk) -> None:
    """ROS 2's lines."""
    async with desk.node() as node:
        speaking(node)
        await node.get_graph()
        ended = await desk.callboard("topic", "bw", "said", "--subscribe", *PATIENCE)
        document = (await desk.callboard("topic", "bw", "said", "--subscribe", *PATIENCE, "--json")).json
    assert (ended.code, without_silence(ended.err)) == (0, "")
    assert re.fullmatch(
        r"Subscribed to \[/said\]\n\d+(\.\d\d)? K?B/s from \d+ messages\n"
        r"\tMessage size mean: 12 B min: 12 B max: 12 B\n",
        ended.out,
    ), ended.out
    assert (document["min_bytes"], document["max_bytes"]) == (12, 12)


@pytest.mark.parametrize(
    ("size", "text"),
    [(0, "0 B"), (999, "999 B"), (1000, "1.00 KB"), (1024, "1.02 KB"), (2_500_000, "2.50 MB")],
)
def test_bytes_as_people_read_them(size: float, text: str) -> None:
    """In thousands, as ROS 2 has it."""
    assert shown_bytes(size) == text


async def test_delay(desk: Desk) -> None:
    """The age by the header's stamp, which lies in the past here."""
    message = Imu()
    message.header.stamp.sec = 1
    async with desk.node() as node:
        speaking(node, "imu", message=message)
        await node.get_graph()
        ended = await desk.callboard("topic", "delay", "imu", *PATIENCE)
        document = (await desk.callboard("topic", "delay", "imu", *PATIENCE, "--json")).json
    assert (ended.code, without_silence(ended.err)) == (0, "")
    assert re.fullmatch(rf"average delay: {NUMBER}\n\t{SPREAD}\n", ended.out)
    assert document["mean_sec"] > 1e9
    assert set(document) == {"topic", "new", "window", "mean_sec", "min_sec", "max_sec", "std_dev_sec"}


async def test_measurements_in_simulated_time(desk: Desk, monkeypatch: pytest.MonkeyPatch) -> None:
    """With -s they follow /clock, as for a simulation that runs a thousand times as fast."""
    # Otherwise a busy machine may put callbacks off, and the times come before the messages of earlier ones.
    monkeypatch.setattr("actors.callbacks.budget.BUDGET_SEC", math.inf)
    async with desk.node() as node:
        clock, imu = node.create_publisher(Clock, "clock", 10), node.create_publisher(Imu, "imu", 10)
        number = 0

        def step() -> None:
            nonlocal number
            number += 1
            message = Imu()
            message.header.stamp.sec = number
            clock.publish(Clock(clock=Time(sec=number + 3)))
            imu.publish(message)

        node.create_timer(0.01, step)
        await node.get_graph()
        delay, rate, bandwidth = [
            (await desk.callboard("topic", verb, "imu", "-s", *PATIENCE, "--json")).json
            for verb in ("delay", "hz", "bw")
        ]
    assert delay["mean_sec"] == pytest.approx(3.0, abs=1.5)
    assert rate["rate"] == pytest.approx(1.0, rel=0.5)
    assert bandwidth["bytes_per_sec"] == pytest.approx(bandwidth["mean_bytes"], rel=2.0)


@pytest.mark.parametrize("verb", ["hz", "bw", "delay"])
async def test_simulated_time_without_a_clock(desk: Desk, verb: str) -> None:
    """It would wait for a time in silence."""
    async with desk.node() as node:
        node.create_publisher(Imu, "imu", 10)
        await node.get_graph()
        ended = await desk.callboard("topic", verb, "imu", "-s", "--timeout", "0.01")
    assert ended.code == 124
    assert "WARNING: topic [/clock] does not appear to be published yet" in ended.err


async def test_delay_needs_a_header(desk: Desk) -> None:
    """ROS 2's text, and what it means."""
    async with desk.node() as node:
        speaking(node)
        await node.get_graph()
        ended = await desk.callboard("topic", "delay", "said")
    assert (ended.code, ended.out) == (1, "")
    # Said once a second until then, if the machine pauses.
    assert without_silence(ended.err) == (
        "msg does not have header: the delay is read from header.stamp, which messages of /said do not have\n"
    )


@pytest.mark.parametrize("verb", ["hz", "bw", "delay"])
async def test_a_bad_name_is_wrong_usage(desk: Desk, verb: str) -> None:
    """As everywhere."""
    assert (await desk.callboard("topic", verb, "9said")).code == 2


async def test_delay_and_hz_leave_out_hostile_messages(desk: Desk) -> None:
    """They are reported once; what else comes is measured."""
    async with desk.node() as node:
        publisher = node.create_publisher(Imu, "imu", 10)
        good = codec_for(Imu).encode(Imu())

        def publish() -> None:
            for data in (b"\xff\xff", b"\xff\xff", good):
                endpoint_of(publisher).collect(data)

        node.create_timer(0.01, publish)
        await node.get_graph()
        delay = await desk.callboard("topic", "delay", "imu", *PATIENCE)
        rate = await desk.callboard("topic", "hz", "imu", "--filter", "m.header", *PATIENCE)
    assert (delay.code, rate.code) == (0, 0)
    for ended in (delay, rate):
        assert ended.err.startswith("A message of /imu is left out: Not a message")
        assert re.fullmatch(r"\d+ messages of /imu left out in all", ended.err.splitlines()[1])
    assert "average delay" in delay.out
    assert "average rate" in rate.out


def second(verb: Callable[[argparse.Namespace, Any], bool], watched: list[Any], *options: str) -> bool:
    """Show one second of it, as the command does."""
    return verb(argparse.Namespace(json="--json" in options, once=False), watched)


def test_a_topic_that_stops_leaves_the_table(capsys: pytest.CaptureFixture[str]) -> None:
    """A row is of this second: without new messages there is none, and in JSON its rate is null."""
    alive, dead = WatchedTopic("/alive", 100), WatchedTopic("/dead", 100)
    for stamp in range(4):
        for each in (alive, dead):
            each.counter.add(float(stamp), stamp + 1, 10 * stamp)
    alive.new, dead.new = 1, 0
    assert second(print_counted, [alive, dead])
    table = capsys.readouterr().out
    assert "/alive" in table
    assert "/dead" not in table
    second(print_counted, [alive, dead], "--json")
    lines = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    assert [line["rate"] for line in lines] == [1.0, None]
    assert lines[1]["window"] == 0
    assert not second(print_counted, [dead])
    assert capsys.readouterr().err == "no new messages\n"


def test_a_received_topic_that_stops_leaves_the_table(capsys: pytest.CaptureFixture[str]) -> None:
    """As by the counters."""
    alive, dead = (RateMeter(name, None, lambda _: True) for name in ("/alive", "/dead"))
    for stamp in range(4):
        for each in (alive, dead):
            each.rate.add(float(stamp))
    alive.new, dead.new = 1, 0
    assert second(print_received, [alive, dead])
    table = capsys.readouterr().out
    assert "/alive" in table
    assert "/dead" not in table
    second(print_received, [dead], "--json")
    assert json.loads(capsys.readouterr().out)["rate"] is None


@pytest.mark.parametrize(("given", "least_sec"), [(None, 1.0), (2, 0.0)])
def test_a_window_that_is_given_is_meant(given: int | None, least_sec: float) -> None:
    """By counters as by messages: only the default one reaches back a second at least."""
    watched = WatchedTopic("/said", given or 2, least_sec=least_sec)
    for number in range(100):
        watched.counter.add(number / 100, number, 0)
    rate = watched.counter.rate()
    assert rate is not None
    assert (rate.window > 90) is (given is None)


async def test_a_broker_that_goes_and_comes_back(capsys: pytest.CaptureFixture[str]) -> None:
    """One note with what starts it; when it is there again, it is queried again."""
    with held_port() as port:
        async with Broker(BrokerOptions(port=port)) as first:
            asked = Inspector(first.url)
            reports = ReportReader(asked)
            await asyncio.to_thread(asked.connect)
            assert await asyncio.to_thread(reports.read)
        assert [await asyncio.to_thread(reports.read) for _ in range(3)] == [None] * 3
        text = capsys.readouterr().err
        assert text.count("\n") == 1
        assert text.endswith(
            f"; waiting for it to come back. Start one with: callboard broker --port {port}\n"
        )
        async with Broker(BrokerOptions(port=port)):
            assert await asyncio.to_thread(reports.read)
            await asyncio.to_thread(asked.close)


async def test_a_lost_broker_whose_host_is_unknown_now(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Once reconnecting fails for another reason, stderr says that one, too."""

    def unresolved(*_: object, **__: object) -> None:
        raise socket.gaierror(socket.EAI_NONAME, "Name or service not known")

    async with Broker(BrokerOptions(port=0)) as broker:
        asked = Inspector(f"callboard://localhost:{broker.url.rpartition(':')[2]}")
        reports = ReportReader(asked)
        await asyncio.to_thread(asked.connect)
        assert await asyncio.to_thread(reports.read)
    monkeypatch.setattr(socket, "getaddrinfo", unresolved)
    assert [await asyncio.to_thread(reports.read) for _ in range(3)] == [None] * 3
    lost, unknown = capsys.readouterr().err.splitlines()
    assert "waiting for it to come back. Start one with" in lost
    assert unknown.endswith("The host name 'localhost' cannot be resolved")


def test_the_counters_of_another_broker_begin_anew() -> None:
    """What it has counted before is not new, however much it is."""
    said, broker = WatchedTopic("/said", 10), FakeBroker(10.0)
    said.add(broker.report())
    said.add(None)
    broker.pause(100.0)
    said.add(broker.report())
    assert said.new == 0
    assert said.counter.rate() is None


async def test_a_broker_that_goes_while_it_is_asked(desk: Desk) -> None:
    """The text says what starts one."""

    def ask() -> None:
        with open_inspector(argparse.Namespace(url=desk.url, domain=None, context=None)):
            raise BrokerUnreachable("The link broke")

    with pytest.raises(BrokerUnreachable, match=r"The link broke\. Start one with: callboard broker --port"):
        await asyncio.to_thread(ask)
