"""Bags with messages, definitions and hashes of real ROS 2 are played, and arrive as they were."""

from __future__ import annotations

from contextlib import AsyncExitStack
from random import Random
from typing import TYPE_CHECKING, Any, Final

from mcap.writer import Writer as McapWriter

from actors.bags import Player, Reader
from actors.bags.contents.qos_lists import qos_text
from actors.bags.operations.check import check
from actors.interfaces import cdr
from actors.interfaces.message import type_name
from actors.interfaces.registry import find_interface
from actors.qos.profile import QoSProfile
from tests.actors.bags.bags import START_NS
from tests.actors.meeting import Meeting, until
from tests.interfaces.imported import TYPES
from tests.interfaces.random_messages import message_classes, random_message, values_of
from tests.real_ros import REAL_PYTHON
from tests.real_ros.differences import agree
from tests.real_ros.test_types import ONLY_HERE, common

if TYPE_CHECKING:
    from pathlib import Path

    from actors.interfaces.message import Message
    from tests.real_ros.sides import Side

LINE: Final = "=" * 80
SHARE: Final = REAL_PYTHON.parent.parent / "share"


def recorded_class(name: str) -> type[Message]:
    """Return what a bag has of it: the message, the events of a service, or the feedback of an action."""
    ends = {"msg": "", "srv": "_Event", "action": "_FeedbackMessage"}
    wanted = name + ends[name.split("/")[1]]
    return next(each for each in message_classes(find_interface(name)) if type_name(each) == wanted)


def definition_of(name: str, real: Side) -> tuple[str, str]:
    """Return format and text of the definition that rosbag2 writes: installed files, with all contained."""
    described = real.call("message_types.type_description", name)["referenced_type_descriptions"]
    names = [name, *(each["type_name"] for each in described if "/msg/" in each["type_name"])]
    if not all(file_of(each).exists() for each in names):  # ROS 2 has some types as .idl only
        files = ((each, SHARE / f"{each}.idl") for each in names)
        return "ros2idl", "".join(f"{LINE}\nIDL: {each}\n{file.read_text()}\n" for each, file in files)
    nested = (f"{LINE}\nMSG: {each.replace('/msg/', '/')}\n{file_of(each).read_text()}" for each in names[1:])
    return "ros2msg", "\n".join([file_of(name).read_text(), *nested])


def file_of(name: str) -> Path:
    return SHARE / f"{name}.{name.split('/')[1]}"


def write_bag(path: Path, names: list[str], real: Side) -> list[Any]:
    """Write a message of each interface, encoded by rclpy; return their values there."""
    random = Random(37)
    values: list[Any] = []
    with path.open("wb") as file:
        writer = McapWriter(file)
        writer.start("ros2")
        for index, name in enumerate(names):
            cls = recorded_class(name)
            sent = cdr.encode(random_message(cls, random)).hex()
            [(value, written)] = real.call("serialization.exchanged", type_name(cls), [sent])
            values.append(value)
            text_format, text = definition_of(name, real)
            schema = writer.register_schema(type_name(cls), text_format, text.encode())
            metadata = {"offered_qos_profiles": qos_text([QoSProfile(depth=5)])}
            if "/msg/" in name:
                metadata["topic_type_hash"] = real.call("message_types.hashes", name)[name]
            channel = writer.register_channel(f"/topic{index}", "cdr", schema, metadata)
            writer.add_message(channel, START_NS + index, bytes.fromhex(written), START_NS - index)
        writer.finish()  # type: ignore[no-untyped-call]
    return values


async def test_bags_of_ros_are_played(real: Side, tmp_path: Path) -> None:
    """Messages that rclpy has serialised: all types, services' events and actions' feedback."""
    packages = sorted(TYPES.keys() - ONLY_HERE)
    names = [name for package in packages for name in common(package, real)]
    values = write_bag(tmp_path / "trip.mcap", names, real)
    with Reader(tmp_path / "trip.mcap") as bag:
        report = check(bag)
    assert (report.problems, report.messages.total()) == ([], len(names))
    heard: dict[int, tuple[Any, int]] = {}
    async with AsyncExitStack() as stack:
        meeting = Meeting(stack)
        await meeting.open()
        stack.push_async_callback(meeting.stop_broker)
        node = await meeting.node("listener")
        for index, name in enumerate(names):

            def keep(found: Message, info: Any, index: int = index) -> None:
                heard[index] = values_of(found), info.source_timestamp

            node.create_subscription(recorded_class(name), f"/topic{index}", keep, 1)
        await meeting.settled(node)
        async with Player(tmp_path / "trip.mcap", url=meeting.url) as playing:
            await playing.wait()
            await until(lambda: len(heard) == len(names))
    for index, name in enumerate(names):
        callboard = [heard[index][0], heard[index][1]]
        agree("bag", name, real=[values[index], START_NS - index], callboard=callboard)
