"""`callboard topic echo`."""

from __future__ import annotations

import base64
import builtins
import threading
from typing import TYPE_CHECKING

import pytest

import actors
from actors.cli.main import main
from actors.endpoints.endpoint import endpoint_of
from actors.interfaces.geometry_msgs.msg import Twist, Vector3
from actors.interfaces.std_msgs.msg import Float64MultiArray, Int32, String
from actors.interfaces.tf2_msgs.msg import TFMessage
from tests.hostile.decode_bytes import starved

if TYPE_CHECKING:
    from tests.actors.cli.conftest import Desk, Ended

LATCHED = actors.QoSProfile(depth=1, durability=actors.DurabilityPolicy.TRANSIENT_LOCAL)


async def echoed(desk: Desk, message: actors.Message, *options: str) -> Ended:
    """Publish a message once, latched; return what an echo of it prints."""
    async with desk.node() as node:
        node.create_publisher(type(message), "said", LATCHED).publish(message)
        await node.get_graph()
        return await desk.callboard("topic", "echo", "/said", "--once", "--timeout", "20", *options)


async def test_echo_is_yaml_and_a_rule(desk: Desk) -> None:
    """ROS 2's form, quotes included."""
    ended = await echoed(desk, String(data="Hello World: 5"))
    assert ended == (0, "data: 'Hello World: 5'\n---\n", "")


@pytest.mark.parametrize(
    ("options", "out"),
    [
        (["--json"], '{"data": "Hello World: 5"}\n'),
        (["--csv"], "Hello World: 5\n"),
        (["--field", "data"], "Hello World: 5\n---\n"),
        (["--flow-style"], "{data: 'Hello World: 5'}\n---\n"),
        (["--truncate-length", "5"], "data: Hello...\n---\n"),
        (["--no-str"], "data: '<string length: <14>>'\n---\n"),
    ],
)
async def test_echo_in_other_forms(desk: Desk, options: list[str], out: str) -> None:
    """As the options say."""
    assert (await echoed(desk, String(data="Hello World: 5"), *options)).out == out


async def test_echo_of_a_field_with_fields(desk: Desk) -> None:
    """Only that part, as YAML."""
    twist = Twist(angular=Vector3(x=1.0))
    ended = await echoed(desk, twist, "--field", "angular")
    assert ended.out == "x: 1.0\ny: 0.0\nz: 0.0\n---\n"
    assert (await echoed(desk, twist, "--field", "angular.x", "--json")).json == 1.0


async def test_echo_of_an_element(desk: Desk) -> None:
    """Arrays have their elements by number."""
    message = Float64MultiArray(data=[0.5, 1.5])
    assert (await echoed(desk, message, "--field", "data[1]")).out == "1.5\n---\n"
    assert (await echoed(desk, message, "--no-arr", "--field", "data")).out.startswith(
        "<sequence type: double"
    )


@pytest.mark.parametrize(
    ("field", "text"),
    [
        ("not_member", "Invalid field 'not_member': there is no 'not_member' in it\n"),
        ("data.x", "Invalid field 'data.x': there is no 'x' in it\n"),
        (".", "Invalid field value '.'\n"),
        ("", "Invalid field value ''\n"),
    ],
)
async def test_echo_of_no_field(desk: Desk, field: str, text: str) -> None:
    """A field that is not there ends the command."""
    ended = await echoed(desk, String(), "--field", field)
    assert (ended.code, ended.err) == (1, text)


async def test_echo_shows_long_values_short_but_not_as_json(desk: Desk) -> None:
    """128 is ROS 2's limit; --full-length lifts it."""
    message = String(data="x" * 200)
    assert (await echoed(desk, message)).out == f"data: {'x' * 128}...\n---\n"
    assert (await echoed(desk, message, "--full-length")).out == f"data: {'x' * 200}\n---\n"
    assert (await echoed(desk, message, "--json")).json == {"data": "x" * 200}


async def test_echo_of_what_steers_terminals(desk: Desk) -> None:
    """Escaped in every form."""
    for options in ([], ["--field", "data"], ["--csv"], ["--json"], ["--raw"]):
        ended = await echoed(desk, String(data="\x1b[2J\u202e"), *options)
        assert ended.code == 0
        assert not {"\x1b", "\u202e"} & set(ended.out)


async def test_raw_echo_is_msgpack(desk: Desk) -> None:
    """The bytes as they travel."""
    assert (await echoed(desk, String(data="hi"), "--raw")).out == "b'\\x81\\xa4data\\xa2hi'\n---\n"
    document = (await echoed(desk, String(data="hi"), "--raw", "--json")).json
    assert base64.b64decode(document["msgpack"]) == b"\x81\xa4data\xa2hi"


async def test_a_type_need_not_be_known(desk: Desk) -> None:
    """Messages are maps that say what they hold."""
    stranger = type(
        "Stranger", (actors.Message,), {"__annotations__": {"text": str}}, type_name="far_away/msg/X"
    )
    assert (await echoed(desk, stranger(text="hi"))).out == "text: hi\n---\n"


async def test_two_types_on_one_topic_are_both_printed(desk: Desk) -> None:
    """Without a TYPE, everything on the topic is received."""
    async with desk.node() as node:
        node.create_publisher(String, "said", LATCHED).publish(String(data="x"))
        node.create_publisher(Vector3, "said", LATCHED).publish(Vector3())
        await node.get_graph()
        first = await desk.callboard("topic", "echo", "/said", "--json", "--timeout", "3")
    assert first.code == 124
    assert sorted(map(str, first.documents)) == ["{'data': 'x'}", "{'x': 0.0, 'y': 0.0, 'z': 0.0}"]


async def test_echo_with_a_type_waits_for_the_topic(desk: Desk) -> None:
    """A warning says that nobody publishes yet."""
    echo = desk.start("topic", "echo", "late", "std_msgs/msg/String", "--once", "--timeout", "30")
    async with desk.node() as node:
        publisher = node.create_publisher(String, "late", 10)
        await desk.matched(publisher)
        publisher.publish(String(data="here"))
        ended = await echo
    assert ended.out == "data: here\n---\n"
    assert ended.err in {"WARNING: topic [/late] does not appear to be published yet\n", ""}


async def test_echo_of_an_unknown_topic(desk: Desk) -> None:
    """ROS 2's text, and what helps."""
    ended = await desk.callboard("topic", "echo", "/nobody")
    assert (ended.code, ended.out) == (1, "")
    assert ended.err == (
        "Could not determine the type for the passed topic: nobody publishes '/nobody'; to wait for it, name "
        "its type: callboard topic echo /nobody TYPE\n"
    )


async def test_echo_of_a_mistyped_topic(desk: Desk) -> None:
    """The one that was meant is suggested."""
    async with desk.node() as node:
        node.create_publisher(String, "addison", 10)
        await node.get_graph()
        ended = await desk.callboard("topic", "echo", "adison")
    assert ended.code == 1
    assert ended.err.endswith("nobody publishes '/adison'; did you mean '/addison'?\n")


async def test_echo_gives_up(desk: Desk) -> None:
    """No message within --timeout: 124."""
    async with desk.node() as node:
        node.create_publisher(String, "silent", 10)
        await node.get_graph()
        ended = await desk.callboard("topic", "echo", "/silent", "--timeout", "0.05")
    assert ended == (124, "", "No message on /silent within 0.05 s\n")


def test_an_unknown_type_is_found_first(capsys: pytest.CaptureFixture[str]) -> None:
    """No broker is needed for that."""
    assert main(["topic", "echo", "/x", "no_such/msg/Type"]) == 1
    assert capsys.readouterr().err == "Unknown package 'no_such'\n"


async def test_a_bad_topic_name_is_wrong_usage(desk: Desk) -> None:
    """The text points at the fault."""
    ended = await desk.callboard("topic", "echo", "with spaces")
    assert ended.code == 2
    assert ended.err.startswith("Invalid topic name")


async def test_echo_of_some_messages(desk: Desk) -> None:
    """A filter chooses, in every form; --once waits for one that is chosen."""
    async with desk.node() as node:
        kept = actors.QoSProfile(depth=9, durability=actors.DurabilityPolicy.TRANSIENT_LOCAL)
        publisher = node.create_publisher(Int32, "said", kept)
        for number in range(9):
            publisher.publish(Int32(data=number))
        await node.get_graph()
        wanted = ("topic", "echo", "/said", "--filter", "m.data % 4 == 3")
        some = await desk.callboard(*wanted, "--csv", "--timeout", "3")
        one = await desk.callboard(*wanted, "--once")
        typed = await desk.callboard("topic", "echo", "/said", "std_msgs/msg/Int32", *wanted[3:], "--once")
        raw = await desk.callboard(*wanted, "--once", "--raw")
    assert (some.code, some.out) == (124, "3\n7\n")
    assert one == typed == (0, "data: 3\n---\n", "")
    assert raw.out == "b'\\x81\\xa4data\\x03'\n---\n"


@pytest.mark.parametrize(
    ("expression", "text"),
    [("m.data >", "is no Python expression"), ("m.nothing > 1", "failed: AttributeError")],
)
async def test_echo_of_a_bad_filter(desk: Desk, expression: str, text: str) -> None:
    """It ends the command, with the reason."""
    ended = await echoed(desk, String(), "--filter", expression)
    assert (ended.code, ended.out) == (1, "")
    assert text in ended.err


async def test_echo_with_message_info(desk: Desk) -> None:
    """Times, number and publisher, before each message."""
    message, options = String(data="hi"), ("--include-message-info",)
    ended = await echoed(desk, message, *options)
    assert [line.split(":")[0] for line in ended.out.splitlines()] == [
        "source_timestamp",
        "received_timestamp",
        "publication_sequence_number",
        "publisher_gid",
        "publisher_node",
        "---",
        "data",
        "---",
    ]
    document = (await echoed(desk, message, *options, "--json")).json
    assert document["message"] == {"data": "hi"}
    assert document["info"]["publisher_node"] == "/fellow"
    assert len(document["info"]["publisher_gid"]) == 32
    values = (await echoed(desk, message, *options, "--csv")).out.rstrip().split(",")
    assert (values[2], values[4:]) == ("0", ["/fellow", "hi"])
    raw = (await echoed(desk, message, *options, "--raw", "--json")).json
    assert set(raw) == {"info", "msgpack"}


@pytest.mark.parametrize("silent", [False, True])
async def test_echo_says_what_it_has_missed(
    desk: Desk, monkeypatch: pytest.MonkeyPatch, silent: bool
) -> None:
    """On stderr, unless told not to."""
    go_on = threading.Event()
    monkeypatch.setattr(builtins, "go_on", go_on.wait, raising=False)
    options = ["--no-lost-messages"] if silent else []
    async with desk.node() as node:
        publisher = node.create_publisher(String, "said", 1)
        await node.get_graph()
        slow = ("--filter", "go_on(50) and m.data == 'end'", "--qos-depth", "1")
        echo = desk.start("topic", "echo", "/said", "--once", *slow, *options)
        await desk.matched(publisher)
        for _ in range(200):  # far more than sockets hold
            publisher.publish(String(data="x" * 200_000))
            await publisher.flush(10)
        publisher.publish(String(data="end"))
        await publisher.flush(10)
        go_on.set()
        ended = await echo
    assert ended.out == "data: end\n---\n"
    assert ("message(s) of /said lost: too fast, or lost on the way" in ended.err) is not silent


async def test_echo_requests_the_qos_it_is_given(desk: Desk) -> None:
    """A preset, as the graph shows it."""
    async with desk.node() as node:
        publisher = node.create_publisher(String, "said", 10)
        await node.get_graph()
        echo = desk.start("topic", "echo", "/said", "--qos-profile", "sensor_data", "--once")
        await desk.matched(publisher)
        (info,) = await node.get_subscriptions_info_by_topic("said")
        publisher.publish(String(data="hi"))
        assert (await echo).out == "data: hi\n---\n"
    assert info.qos_profile == actors.qos_profile_sensor_data


DEEP = b"\x81\xa4data" + b"\x91" * 300 + b"\xc0"
TIME = b"\x81\xa4data\xd6\xff\x00\x00\x00\x01"


@pytest.mark.parametrize("options", [[], ["--json"], ["--csv"], ["--filter", "m.data or True"]])
async def test_echo_outlives_hostile_messages(desk: Desk, options: list[str]) -> None:
    """What is nested too deeply or no message is reported and passed over; a time of msgpack's is text."""
    async with desk.node() as node:
        kept = actors.QoSProfile(depth=9, durability=actors.DurabilityPolicy.TRANSIENT_LOCAL)
        publisher = node.create_publisher(String, "said", kept)
        for data in (DEEP, b"\xff\xff", TIME):
            endpoint_of(publisher).collect(data)
        publisher.publish(String(data="end"))
        await node.get_graph()
        ended = await desk.callboard("topic", "echo", "/said", *options, "--timeout", "3")
    assert ended.code == 124
    assert ended.err.count("Not a message") == 2
    assert "1970-01-01T00:00:01+00:00" in ended.out.splitlines()[0]
    assert "end" in ended.out


@pytest.mark.parametrize("options", [["--field", "data[0]"], ["--filter", "m.data[0] == 'x'"]])
async def test_a_stranger_does_not_end_an_echo(desk: Desk, options: list[str]) -> None:
    """Once a message has had the field, one without it is reported and passed over."""
    async with desk.node() as node:
        kept = actors.QoSProfile(depth=9, durability=actors.DurabilityPolicy.TRANSIENT_LOCAL)
        publisher = node.create_publisher(String, "said", kept)
        for data in (b"\x81\xa4data\xa1x", b"\x81\xa4data\x05", b"\x81\xa4data\xa1x"):
            endpoint_of(publisher).collect(data)
        await node.get_graph()
        ended = await desk.callboard("topic", "echo", "/said", *options, "--timeout", "3")
    assert ended.code == 124
    assert ended.out.count("x") == 2


async def test_echo_with_the_wrong_type_does_not_wait(desk: Desk) -> None:
    """What is published is named; --raw hears every type."""
    ended = await echoed(desk, String(data="hi"), "std_msgs/msg/Int32")
    assert ended == (1, "", "'/said' is published as std_msgs/msg/String, not std_msgs/msg/Int32\n")
    assert (await echoed(desk, String(data="hi"), "std_msgs/msg/Int32", "--raw")).code == 0


async def test_echo_with_another_definition_of_a_type_does_not_wait(desk: Desk) -> None:
    """The name alone would not tell them apart."""
    other = type("Other", (actors.Message,), {"__annotations__": {"x": int}}, type_name="std_msgs/msg/String")
    ended = await echoed(desk, other(x=1), "std_msgs/msg/String")
    assert (
        ended.err
        == "'/said' is published as another definition of std_msgs/msg/String, not std_msgs/msg/String\n"
    )


@pytest.mark.parametrize("other", ["--json", "--raw"])
def test_options_that_exclude_each_other(other: str, capsys: pytest.CaptureFixture[str]) -> None:
    """No broker is needed to say so."""
    assert main(["topic", "echo", "/x", "--csv", other]) == 2
    assert capsys.readouterr().err == f"Give --csv or {other}, not both\n"


async def test_echo_with_what_it_knows_of_a_message_first(desk: Desk) -> None:
    """-i is --include-message-info."""
    short, long = [
        await echoed(desk, String(data="hello"), each) for each in ("-i", "--include-message-info")
    ]
    assert short.out.startswith("source_timestamp: ")
    assert [line.partition(":")[0] for line in short.out.splitlines()] == [
        line.partition(":")[0] for line in long.out.splitlines()
    ]


async def test_echo_clears_a_terminal_only(desk: Desk, monkeypatch: pytest.MonkeyPatch) -> None:
    """-c writes the escapes before a message, and none into a file."""
    assert (await echoed(desk, String(data="hello"), "-c")).out == "data: hello\n---\n"
    monkeypatch.setattr("sys.stdout.isatty", lambda: True, raising=False)
    assert (await echoed(desk, String(data="hello"), "-c")).out == "\x1b[2J\x1b[Hdata: hello\n---\n"


async def test_echo_under_a_name(desk: Desk) -> None:
    """-n names the node, which others can see."""
    async with desk.node() as node:
        publisher = node.create_publisher(String, "said", LATCHED)
        await node.get_graph()
        command = desk.start("topic", "echo", "/said", "-n", "listener", "--once", "--timeout", "20")
        await desk.matched(publisher)
        assert "/listener" in (await node.get_graph()).nodes()
        publisher.publish(String(data="hello"))
        assert (await command).out == "data: hello\n---\n"


@pytest.mark.parametrize("value", ["unknown", "best_available"])
async def test_echo_with_an_open_policy_takes_what_fits(desk: Desk, value: str) -> None:
    """Left open, a policy is that of the publisher: a latched message arrives."""
    options = ("--qos-durability", value, "--qos-reliability", value)
    assert (await echoed(desk, String(data="hello"), *options)).out == "data: hello\n---\n"
    assert (await echoed(desk, String(data="hello"), "--qos-profile", value)).out == "data: hello\n---\n"


@pytest.mark.parametrize("types", [["tf2_msgs/msg/TFMessage"], []])
async def test_echo_refuses_what_leaves_out_too_much(
    desk: Desk, types: list[str], caplog: pytest.LogCaptureFixture
) -> None:
    """Case 62: with the type given or found; it says so, and prints the next message."""
    async with desk.node() as node:
        publisher = node.create_publisher(
            TFMessage, "tf", actors.QoSProfile(depth=2, durability=actors.DurabilityPolicy.TRANSIENT_LOCAL)
        )
        publisher.publish_encoded(starved("transforms", 100_000))
        publisher.publish(TFMessage())
        await node.get_graph()
        ended = await desk.callboard("topic", "echo", "/tf", *types, "--once", "--timeout", "20")
    assert (ended.code, ended.out) == (0, "transforms: []\n---\n")
    assert "write every field of a large message" in ended.err + caplog.text
