"""The node that records, against a broker and publishers in the test's loop."""

from __future__ import annotations

import asyncio
import json
import shutil
import threading
from typing import TYPE_CHECKING, Any

import pytest
import yaml

import actors
from actors.bags.errors import BagExistsError, BagFullError, BagWriteError
from actors.bags.reader import Reader
from actors.bags.recorder import recorder as module
from actors.bags.recorder.options import RecorderOptions
from actors.bags.recorder.recorder import Recorder
from actors.bags.selection import Selection
from actors.bags.writer import Writer
from actors.interfaces.example_interfaces.action import Fibonacci
from actors.interfaces.example_interfaces.srv import AddTwoInts
from actors.interfaces.rosbag2_interfaces.msg import WriteSplitEvent
from actors.interfaces.rosbag2_interfaces.srv import (
    IsDiscoveryRunning,
    IsPaused,
    Pause,
    Resume,
    Snapshot,
    SplitBagfile,
    StartDiscovery,
    Stop,
    StopDiscovery,
    TogglePaused,
)
from actors.interfaces.rosgraph_msgs.msg import Clock
from actors.interfaces.std_msgs.msg import Int32, String
from actors.interfaces.std_srvs.srv import Trigger
from tests.actors.bags.recorder.recordings import files_of, messages_of
from tests.actors.meeting import KEEP_ALL, Meeting, latched, until

if TYPE_CHECKING:
    from pathlib import Path


class Gauge(actors.Message, type_name="bag_tests/msg/Gauge"):
    """A type that no package has."""

    level: float = 0.0


def recorder(
    meeting: Meeting, path: Path, *topics: str, selection: Selection | None = None, **options: Any
) -> Recorder:
    """Return a recorder of some topics."""
    chosen = selection or Selection(topics=topics)
    return Recorder(path, chosen, RecorderOptions(**options), url=meeting.url)


async def publisher(node: actors.Node, topic: str, qos: Any = 10, msg_type: Any = String) -> Any:
    """Return a publisher that is matched."""
    found = node.create_publisher(msg_type, topic, qos)
    await until(lambda: found.get_subscription_count() > 0)
    return found


async def written(recording: Recorder, count: int) -> None:
    """Wait until so many messages are in the bag."""
    await until(lambda: recording.statistics().written >= count)


def texts(path: Path) -> list[str]:
    """Return the texts of a bag's messages."""
    return [each.decoded(String).data for each in messages_of(path)]


def metadata_of(bag: Path) -> dict[str, Any]:
    """Return what metadata.yaml says."""
    document = yaml.safe_load((bag / "metadata.yaml").read_text(encoding="utf-8"))
    found: dict[str, Any] = document["rosbag2_bagfile_information"]
    return found


async def test_messages_are_in_the_bag_with_their_times_and_numbers(meeting: Meeting, tmp_path: Path) -> None:
    """Log time is the reception, publish time the publisher's stamp, the sequence its number."""
    node = await meeting.node("talker")
    heard: list[actors.MessageInfo] = []
    node.create_subscription(String, "/chatter", lambda _, info: heard.append(info), 1000)
    async with recorder(meeting, tmp_path / "trip", "/chatter") as recording:
        talker = await publisher(node, "/chatter", 1000)
        await until(lambda: talker.get_subscription_count() == 2)
        for index in range(300):
            talker.publish(String(data=str(index)))
        await written(recording, 300)
        await until(lambda: len(heard) == 300)
    found = messages_of(tmp_path / "trip")
    assert [each.decoded(String).data for each in found] == [str(index) for index in range(300)]
    assert [each.sequence for each in found] == list(range(300))
    assert [each.publish_time for each in found] == [info.source_timestamp for info in heard]
    assert all(each.log_time >= each.publish_time for each in found)
    assert {(each.topic, each.type_name) for each in found} == {("/chatter", "std_msgs/msg/String")}
    metadata = metadata_of(tmp_path / "trip")
    assert metadata["message_count"] == 300
    assert metadata["topics_with_message_count"][0]["topic_metadata"]["name"] == "/chatter"


async def test_a_named_topic_is_recorded_from_its_first_message(meeting: Meeting, tmp_path: Path) -> None:
    """The recorder subscribes before the topic exists, whatever its type is."""
    node = await meeting.node("talker")
    async with recorder(meeting, tmp_path / "trip", "/late") as recording:
        talker = await publisher(node, "/late")
        for text in ("first", "second"):
            talker.publish(String(data=text))
        await written(recording, 2)
    assert texts(tmp_path / "trip") == ["first", "second"]


async def test_new_topics_are_found(meeting: Meeting, tmp_path: Path) -> None:
    """Topics that appear later are recorded, and hidden ones are not; the bag lists silent topics, too."""
    node = await meeting.node("talker")
    async with recorder(meeting, tmp_path / "trip", selection=Selection(regex="^/arm/")) as recording:
        talker = await publisher(node, "/arm/a")
        node.create_publisher(String, "/leg/a", 10)
        node.create_publisher(String, "/arm/_a", 10)
        await publisher(node, "/arm/b")
        talker.publish(String(data="x"))
        await written(recording, 1)
    names = [
        each["topic_metadata"]["name"] for each in metadata_of(tmp_path / "trip")["topics_with_message_count"]
    ]
    assert sorted(names) == ["/arm/a", "/arm/b"]
    assert texts(tmp_path / "trip") == ["x"]


async def test_only_what_exists_is_recorded_without_discovery(meeting: Meeting, tmp_path: Path) -> None:
    """Topics that appear later are left out."""
    node = await meeting.node("talker")
    node.create_publisher(String, "/a", 10)
    await meeting.settled(node)
    selection = Selection(all_topics=True, exclude_regex="rosout|parameter_events|events")
    async with recorder(meeting, tmp_path / "trip", selection=selection, no_discovery=True) as recording:
        node.create_publisher(String, "/b", 10)
        await meeting.settled(node, recording.node)
        assert list(recording.statistics().topics) == ["/a"]


async def test_types_that_are_not_installed_are_recorded(meeting: Meeting, tmp_path: Path) -> None:
    """The broker has their definition."""
    node = await meeting.node("talker")
    async with recorder(meeting, tmp_path / "trip", "/gauge") as recording:
        talker = await publisher(node, "/gauge", msg_type=Gauge)
        talker.publish(Gauge(level=1.5))
        await written(recording, 1)
    (found,) = messages_of(tmp_path / "trip")
    assert (found.type_name, found.decoded(Gauge)) == ("bag_tests/msg/Gauge", Gauge(level=1.5))


async def test_latched_values_are_taken_once_and_begin_each_file(meeting: Meeting, tmp_path: Path) -> None:
    """A value from before the recording is in the bag, and again at the start of the next file."""
    node = await meeting.node("talker")
    map_publisher = node.create_publisher(String, "/map", latched(1))
    map_publisher.publish(String(data="map"))
    chatter = node.create_publisher(String, "/chatter", 10)
    async with recorder(meeting, tmp_path / "trip", "/map", "/chatter") as recording:
        await written(recording, 1)
        chatter.publish(String(data="hello"))
        await written(recording, 2)
        await recording.split()
    first, second = files_of(tmp_path / "trip")
    assert texts(first) == ["map", "hello"]
    assert texts(second) == ["map"]


async def test_files_are_split_and_only_the_newest_kept(meeting: Meeting, tmp_path: Path) -> None:
    """By size, as the options say; the files that are left have the newest messages, without a gap."""
    node = await meeting.node("talker")
    async with recorder(meeting, tmp_path / "trip", "/chatter", max_bag_size=3000, max_splits=2) as recording:
        talker = await publisher(node, "/chatter", 1000)
        for index in range(100):
            talker.publish(String(data=f"{index} {'x' * 200}"))
        await written(recording, 100)
    assert len(files_of(tmp_path / "trip")) == 2
    numbers = [int(each.split()[0]) for each in texts(tmp_path / "trip")]
    assert 0 < numbers[0] < 99
    assert numbers == list(range(numbers[0], 100))


async def test_the_quality_of_a_subscription_can_be_chosen(meeting: Meeting, tmp_path: Path) -> None:
    """An override wins over what the publishers offer; other topics are as they offer."""
    node = await meeting.node("talker")
    for name in ("/a", "/b"):
        node.create_publisher(String, name, 10)
    await meeting.settled(node)
    chosen = actors.QoSProfile(depth=3, reliability=actors.ReliabilityPolicy.BEST_EFFORT)
    async with recorder(meeting, tmp_path / "trip", "/a", "/b", qos_overrides={"/a": chosen}):
        (first,) = await node.get_subscriptions_info_by_topic("/a")
        (second,) = await node.get_subscriptions_info_by_topic("/b")
    assert (first.qos_profile.depth, first.qos_profile.reliability) == (
        3,
        actors.ReliabilityPolicy.BEST_EFFORT,
    )
    assert second.qos_profile.reliability is actors.ReliabilityPolicy.RELIABLE


async def test_a_strict_publisher_that_is_not_heard_is_named(
    meeting: Meeting, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    """Such as one that begins without latched messages beside others that have some."""
    node = await meeting.node("talker")
    node.create_publisher(String, "/map", latched(1))
    await meeting.settled(node)
    async with recorder(meeting, tmp_path / "trip", "/map"):
        node.create_publisher(String, "/map", 10, strict_qos=True)
        await until(lambda: "a publisher with strict QoS does not match" in caplog.text)


async def test_a_topic_of_two_types_is_not_recorded(
    meeting: Meeting, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    """A bag's topic has one type; a line says why it is missing."""
    nodes = [await meeting.node(name) for name in ("one", "two")]
    types: list[type[Any]] = [String, Int32]
    for node, msg_type in zip(nodes, types, strict=True):
        node.create_publisher(msg_type, "/mixed", 10)
    await meeting.settled(*nodes)
    async with recorder(meeting, tmp_path / "trip", "/mixed") as recording:
        assert not recording.statistics().topics
        assert not await nodes[0].get_subscriptions_info_by_topic("/mixed")
    assert "'/mixed' is not recorded: it has several types" in caplog.text


async def test_a_recording_pauses(meeting: Meeting, tmp_path: Path) -> None:
    """What arrives while it is paused is in no file, and not counted as lost."""
    node = await meeting.node("talker")
    async with recorder(meeting, tmp_path / "trip", "/chatter", start_paused=True) as recording:
        talker = await publisher(node, "/chatter")
        heard = node.create_subscription(String, "/chatter", lambda _: None)
        for text, paused in {"1": True, "2": False, "3": True, "4": False}.items():
            (recording.pause if paused else recording.resume)()
            assert recording.is_paused is paused
            talker.publish(String(data=text))
            await meeting.settled(node, recording.node)
            await recording.flush()
        assert heard.received == 4
    assert texts(tmp_path / "trip") == ["2", "4"]
    statistics = recording.statistics()
    assert (statistics.received, statistics.lost, statistics.dropped) == (2, 0, 0)
    assert not metadata_of(tmp_path / "trip")["custom_data"]


async def test_other_nodes_control_it(meeting: Meeting, tmp_path: Path) -> None:
    """The services of ROS 2's recorder, with its names and types."""
    node = await meeting.node("remote")
    events: list[WriteSplitEvent] = []
    node.create_subscription(WriteSplitEvent, "/events/write_split", events.append)

    async def call(srv_type: Any, name: str) -> Any:
        client = node.create_client(srv_type, f"/bag_recorder/{name}")
        try:
            return await client.call(srv_type.Request())
        finally:
            client.destroy()

    async with recorder(meeting, tmp_path / "trip", "/chatter") as recording:
        for srv_type, name, paused in (
            (Pause, "pause", True),
            (Resume, "resume", False),
            (TogglePaused, "toggle_paused", True),
            (TogglePaused, "toggle_paused", False),
        ):
            await call(srv_type, name)
            assert (await call(IsPaused, "is_paused")).paused is paused
        await call(SplitBagfile, "split_bagfile")
        await until(lambda: len(events) == 1)
        await call(Stop, "stop")
        await recording.wait()
    first, second = files_of(tmp_path / "trip")
    assert events == [
        WriteSplitEvent(closed_file=str(first), opened_file=str(second), node_name="/bag_recorder")
    ]


async def test_discovery_can_be_stopped(meeting: Meeting, tmp_path: Path) -> None:
    """Topics that appear meanwhile are not recorded before it goes on."""
    node = await meeting.node("remote")

    async def call(srv_type: Any, name: str) -> Any:
        client = node.create_client(srv_type, f"/bag_recorder/{name}")
        try:
            return await client.call(srv_type.Request())
        finally:
            client.destroy()

    async with recorder(meeting, tmp_path / "trip", selection=Selection(regex="^/t")) as recording:
        assert (await call(IsDiscoveryRunning, "is_discovery_running")).running
        refused = await call(StartDiscovery, "start_discovery")
        assert (refused.return_code, refused.error_string) == (1, "Discovery is already running")
        assert (await call(StopDiscovery, "stop_discovery")).return_code == 0
        assert not (await call(IsDiscoveryRunning, "is_discovery_running")).running
        assert (await call(StopDiscovery, "stop_discovery")).return_code == 1
        talker = node.create_publisher(String, "/talk", 1000)
        await meeting.settled(node, recording.node)
        assert not recording.statistics().topics
        assert (await call(StartDiscovery, "start_discovery")).return_code == 0
        await talker.wait_for_subscriptions()
        talker.publish(String(data="x"))
        await written(recording, 1)
    assert texts(tmp_path / "trip") == ["x"]


async def test_snapshots(meeting: Meeting, tmp_path: Path) -> None:
    """Only the newest messages are kept, and they are written when somebody asks for them."""
    node = await meeting.node("talker")
    async with recorder(
        meeting, tmp_path / "trip", "/chatter", snapshot_mode=True, max_cache_size=5000
    ) as recording:
        talker = await publisher(node, "/chatter", 1000)
        client = node.create_client(Snapshot, "/bag_recorder/snapshot")
        for index in range(100):
            talker.publish(String(data=str(index)))
        await until(lambda: recording.statistics().received == 100)
        assert recording.statistics().written == 0
        assert (await client.call(Snapshot.Request())).success
        count = recording.statistics().written
        assert 0 < count < 100
        talker.publish(String(data="kept"))
        await until(lambda: recording.statistics().received == 101)
    assert texts(tmp_path / "trip") == [str(index) for index in range(100 - count, 100)]


async def test_lossless_recording_lets_publishers_wait(meeting: Meeting, tmp_path: Path) -> None:
    """With hardly any memory, everything that a KEEP_ALL publisher could publish is in the bag."""
    node = await meeting.node("talker")
    async with recorder(meeting, tmp_path / "trip", "/data", lossless=True, max_cache_size=1) as recording:
        talker = await publisher(node, "/data", KEEP_ALL, Int32)
        for index in range(2000):
            await talker.ready()
            talker.publish(Int32(data=index))
        await written(recording, 2000)
    assert [each.decoded(Int32).data for each in messages_of(tmp_path / "trip")] == list(range(2000))
    assert recording.statistics().dropped == 0


class StuckWriter(Writer):
    """Writes nothing before it is allowed to."""

    go_on = threading.Event()

    def write(self, *arguments: Any, **keywords: Any) -> None:
        """Wait, and write."""
        self.go_on.wait()
        super().write(*arguments, **keywords)


async def test_what_does_not_fit_into_the_memory_is_counted(
    meeting: Meeting, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A disk that stands still for a while costs messages: the bag says how many, whose, and which."""
    monkeypatch.setattr(module, "Writer", StuckWriter)
    StuckWriter.go_on = threading.Event()
    node = await meeting.node("talker")
    async with recorder(meeting, tmp_path / "trip", "/chatter", max_cache_size=3000) as recording:
        try:
            talker = await publisher(node, "/chatter", 1000)
            for index in range(100):
                talker.publish(String(data=str(index)))
            await until(lambda: recording.statistics().received == 100)
            dropped = recording.statistics().dropped
            report = await node.create_client(Trigger, "/bag_recorder/get_report").call(Trigger.Request())
        finally:
            StuckWriter.go_on.set()
    assert 80 < dropped < 100
    answer = json.loads(report.message)
    assert (answer["received"], answer["written"], answer["losses"]["/chatter"]["dropped"]) == (
        100,
        0,
        dropped,
    )
    assert texts(tmp_path / "trip") == [str(index) for index in range(100 - dropped)]
    with Reader(tmp_path / "trip") as bag:
        assert bag.summary().dropped == {"/chatter": dropped}
    said = metadata_of(tmp_path / "trip")["custom_data"]
    assert json.loads(said["callboard.dropped"]) == {"/chatter": dropped}
    losses = json.loads(said["callboard.losses"])["/chatter"]
    assert losses["dropped"] == dropped
    assert losses["publishers"]["/talker"]["gaps"] == [[100 - dropped, dropped]]


class FullWriter(Writer):
    """The disk is full at the third message."""

    writes = 0

    def write(self, *arguments: Any, **keywords: Any) -> None:
        """Write, or fail."""
        self.writes += 1
        if self.writes > 2:
            raise BagFullError("trip: the disk is full")
        super().write(*arguments, **keywords)

    def lost(self) -> dict[str, int]:
        """Return the message that was not written."""
        return {"/chatter": 1} if self.writes > 2 else {}


async def test_a_full_disk_ends_the_recording(
    meeting: Meeting, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Case 42: one clear error, and a valid file with what has been written; the rest is counted."""
    monkeypatch.setattr(module, "Writer", FullWriter)
    node = await meeting.node("talker")
    async with recorder(meeting, tmp_path / "trip", "/chatter") as recording:
        talker = await publisher(node, "/chatter")
        for index in range(5):
            talker.publish(String(data=str(index)))
        with pytest.raises(BagFullError, match="the disk is full"):
            await recording.wait()
    statistics = recording.statistics()
    assert texts(tmp_path / "trip") == ["0", "1"]
    metadata = metadata_of(tmp_path / "trip")
    assert metadata["message_count"] == 2
    # What is still on its way has not arrived.
    assert statistics.written == 2
    assert statistics.written + statistics.dropped == statistics.received
    assert json.loads(metadata["custom_data"]["callboard.dropped"]) == {"/chatter": statistics.dropped}


async def test_an_error_that_nobody_waited_for_is_raised_at_the_end(
    meeting: Meeting, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Whoever leaves the recorder without `wait` is told, too."""
    monkeypatch.setattr(module, "Writer", FullWriter)
    node = await meeting.node("talker")
    recording = recorder(meeting, tmp_path / "trip", "/chatter")
    await recording.__aenter__()
    talker = await publisher(node, "/chatter")
    for index in range(5):
        talker.publish(String(data=str(index)))
    await until(lambda: recording.statistics().written >= 2)
    with pytest.raises(BagFullError):
        await recording.__aexit__(None, None, None)


async def test_a_removed_folder_ends_the_recording(meeting: Meeting, tmp_path: Path) -> None:
    """A file without a name could be written for hours: the next flush finds that it is gone."""
    node = await meeting.node("talker")
    async with recorder(meeting, tmp_path / "trip", "/chatter") as recording:
        talker = await publisher(node, "/chatter")
        shutil.rmtree(tmp_path / "trip")
        talker.publish(String(data="x"))
        with pytest.raises(BagWriteError, match="removed"):
            await recording.wait()
    assert not (tmp_path / "trip").exists()


async def test_a_bag_is_not_overwritten(meeting: Meeting, tmp_path: Path) -> None:
    """The error says what to do, and the node is gone."""
    (tmp_path / "trip").mkdir()
    recording = recorder(meeting, tmp_path / "trip", "/chatter")
    with pytest.raises(BagExistsError, match="another path"):
        await recording.__aenter__()
    assert not recording.node.connected


class SlowWriter(Writer):
    """Is not open before it is allowed to."""

    begins = threading.Event()
    go_on = threading.Event()

    def __init__(self, *arguments: Any, **keywords: Any) -> None:
        self.begins.set()
        self.go_on.wait()
        super().__init__(*arguments, **keywords)


async def test_a_recorder_that_is_cancelled_while_it_starts_leaves_a_complete_bag(
    meeting: Meeting, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """No thread keeps its file open."""
    monkeypatch.setattr(module, "Writer", SlowWriter)
    SlowWriter.begins, SlowWriter.go_on = threading.Event(), threading.Event()
    recording = recorder(meeting, tmp_path / "trip", "/chatter")
    starting = asyncio.create_task(recording.__aenter__())
    await until(SlowWriter.begins.is_set)
    starting.cancel()
    SlowWriter.go_on.set()
    with pytest.raises(asyncio.CancelledError):
        await starting
    assert metadata_of(tmp_path / "trip")["message_count"] == 0
    assert not recording.node.connected


async def test_a_recording_ends_when_nothing_arrives(meeting: Meeting, tmp_path: Path) -> None:
    """`wait` returns once no message has arrived for so long."""
    async with recorder(meeting, tmp_path / "trip", "/chatter", until_no_messages_sec=0.2) as recording:
        await recording.wait()


async def test_service_events_are_recorded(meeting: Meeting, tmp_path: Path) -> None:
    """A service is named, and the events of its calls are in the bag."""
    node = await meeting.node("calculator")
    service = node.create_service(
        AddTwoInts, "/add", lambda request: AddTwoInts.Response(sum=request.a + request.b)
    )
    service.configure_introspection(
        node.get_clock(), actors.QoSProfile(depth=100), actors.ServiceIntrospectionState.CONTENTS
    )
    client = node.create_client(AddTwoInts, "/add")
    selection = Selection(services=["/add"])
    async with recorder(meeting, tmp_path / "trip", selection=selection) as recording:
        assert list(recording.statistics().topics) == ["/add/_service_event"]
        assert (await client.call(AddTwoInts.Request(a=1, b=2))).sum == 3
        await written(recording, 2)
    first, second = [each.decoded(AddTwoInts.Event) for each in messages_of(tmp_path / "trip")]
    assert (first.request[0].a, first.request[0].b, second.response[0].sum) == (1, 2, 3)


async def test_actions_are_recorded(meeting: Meeting, tmp_path: Path) -> None:
    """Their feedback and status, and the events of their services, which have types of their own."""
    node = await meeting.node("counter")

    def execute(goal: Any) -> Fibonacci.Result:
        goal.publish_feedback(Fibonacci.Feedback(sequence=[0, 1]))
        goal.succeed()
        return Fibonacci.Result(sequence=[0, 1, 1])

    server = node.create_action_server(Fibonacci, "/count", execute)
    server.configure_introspection(
        node.get_clock(), actors.QoSProfile(depth=100), actors.ServiceIntrospectionState.CONTENTS
    )
    client = node.create_action_client(Fibonacci, "/count")
    selection = Selection(actions=["/count"])
    async with recorder(meeting, tmp_path / "trip", selection=selection) as recording:
        assert len(recording.statistics().topics) == 5
        goal = await client.send_goal(Fibonacci.Goal(order=3))
        assert list((await goal.result()).result.sequence) == [0, 1, 1]
        below = "/count/_action"
        wanted = ("feedback", "status", "send_goal/_service_event", "get_result/_service_event")
        await until(lambda: all(recording.statistics().topics[f"{below}/{each}"] for each in wanted))
    with Reader(tmp_path / "trip") as bag:
        found = {each.topic.type_name: each.decoded() for each in bag.messages()}
    feedback: Any = found["example_interfaces/action/Fibonacci_FeedbackMessage"]
    assert list(feedback.feedback.sequence) == [0, 1]
    event: Any = found["example_interfaces/action/Fibonacci_GetResult_Event"]
    assert list(event.response[0].result.sequence) == [0, 1, 1]


async def test_log_times_are_simulated(meeting: Meeting, tmp_path: Path) -> None:
    """Nothing is recorded before the first `/clock`; then log times are its."""
    node = await meeting.node("talker")
    async with recorder(meeting, tmp_path / "trip", "/chatter", use_sim_time=True) as recording:
        talker = await publisher(node, "/chatter")
        clock = await publisher(node, "/clock", msg_type=Clock)
        talker.publish(String(data="early"))
        await meeting.settled(node, recording.node)
        clock.publish(Clock(clock=actors.Time(seconds=5).to_msg()))
        await until(lambda: recording.node.get_clock().now().nanoseconds > 0)
        talker.publish(String(data="x"))
        await written(recording, 1)
    (found,) = messages_of(tmp_path / "trip")
    assert (found.decoded(String).data, found.log_time) == ("x", 5_000_000_000)
    assert found.publish_time > 10**18


async def test_messages_that_are_none_of_the_type_are_counted(meeting: Meeting, tmp_path: Path) -> None:
    """One bad message of a publisher costs no other one, and is in the bag's losses."""
    node = await meeting.node("talker")
    async with recorder(meeting, tmp_path / "trip", "/chatter") as recording:
        talker = await publisher(node, "/chatter")
        talker.publish_encoded(b"\x81\xa4data\x01")
        talker.publish(String(data="a\0b"))
        talker.publish(String(data="good"))
        await written(recording, 1)
    assert texts(tmp_path / "trip") == ["good"]
    assert recording.statistics().invalid == 2
    losses = json.loads(metadata_of(tmp_path / "trip")["custom_data"]["callboard.losses"])
    assert losses["/chatter"]["invalid"] == 2


async def test_a_broker_that_restarts(meeting: Meeting, tmp_path: Path) -> None:
    """Recording goes on with the next session, without a message twice."""
    node = await meeting.node("talker")
    async with recorder(meeting, tmp_path / "trip", "/map") as recording:
        talker = await publisher(node, "/map", latched(5))
        talker.publish(String(data="1"))
        await written(recording, 1)
        await meeting.restart_broker()
        await until(lambda: node.connected and recording.node.connected)
        await until(lambda: talker.get_subscription_count() > 0)
        talker.publish(String(data="2"))
        await written(recording, 2)
    assert texts(tmp_path / "trip") == ["1", "2"]


async def test_cancellation_completes_the_bag(meeting: Meeting, tmp_path: Path) -> None:
    """A cancelled program has recorded what had arrived by then."""
    node = await meeting.node("talker")
    begun = asyncio.Event()
    recordings: list[Recorder] = []

    async def record() -> None:
        async with recorder(meeting, tmp_path / "trip", "/chatter") as recording:
            recordings.append(recording)
            begun.set()
            await recording.wait()

    task = asyncio.create_task(record())
    await begun.wait()
    talker = await publisher(node, "/chatter")
    talker.publish(String(data="x"))
    await until(lambda: recordings[0].statistics().received == 1)
    task.cancel()
    with pytest.raises(asyncio.CancelledError):
        await task
    assert texts(tmp_path / "trip") == ["x"]
    assert metadata_of(tmp_path / "trip")["message_count"] == 1
