"""The protocol's messages, byte by byte."""

from __future__ import annotations

import json
from typing import Any

import pytest

from actors.web.foxglove import messages as wire
from actors.web.foxglove.messages import MessageData, ProtocolError, ServiceCall, parse


@pytest.mark.parametrize(
    ("text", "found"),
    [
        (
            '{"op":"subscribe","subscriptions":[{"id":0,"channelId":3},{"id":1,"channelId":5}]}',
            wire.Subscribe([wire.Subscription(0, 3), wire.Subscription(1, 5)]),
        ),
        ('{"op":"unsubscribe","subscriptionIds":[0,1]}', wire.Unsubscribe([0, 1])),
        (
            '{"op":"advertise","channels":[{"id":1,"topic":"/a","encoding":"json","schemaName":"p/T"}]}',
            wire.Advertise([wire.ClientChannel(1, "/a", "json", "p/T")]),
        ),
        ('{"op":"unadvertise","channelIds":[1]}', wire.Unadvertise([1])),
        ('{"op":"getParameters","parameterNames":[],"id":"x"}', wire.GetParameters([], "x")),
        (
            '{"op":"setParameters","parameters":[{"name":"/n.a","value":3,"type":"float64"},{"name":"/n.b"}]}',
            wire.SetParameters([wire.ParameterItem("/n.a", 3, "float64"), wire.ParameterItem("/n.b")]),
        ),
        (
            '{"op":"subscribeParameterUpdates","parameterNames":["/n.a"]}',
            wire.SubscribeParameterUpdates(["/n.a"]),
        ),
        (
            '{"op":"unsubscribeParameterUpdates","parameterNames":[]}',
            wire.UnsubscribeParameterUpdates([]),
        ),
        ('{"op":"subscribeConnectionGraph"}', wire.SubscribeConnectionGraph()),
        ('{"op":"unsubscribeConnectionGraph"}', wire.UnsubscribeConnectionGraph()),
        ('{"op":"fetchAsset","uri":"package://p/a","requestId":7}', wire.FetchAsset("package://p/a", 7)),
    ],
)
def test_texts_of_clients(text: str, found: object) -> None:
    """Each operation, as the specification shows it."""
    assert parse(text) == found


def test_bytes_of_clients() -> None:
    """A message, and a call with the name of its encoding."""
    assert parse(b"\x01\x02\x01\x00\x00ab") == MessageData(0x102, b"ab")
    call = b"\x02\x07\x00\x00\x00\x08\x00\x00\x00\x04\x00\x00\x00json{}"
    assert parse(call) == ServiceCall(7, 8, "json", b"{}")


@pytest.mark.parametrize(
    "message",
    [
        b"",
        b"\x00",
        b"\x01\x00\x00",
        b"\x02" + bytes(11),
        b"\x02" + bytes(8) + b"\xff\xff\xff\xff",
        b"\x03" + bytes(100),
        "",
        "[]",
        "{}",
        '{"op":"login"}',
        '{"op":5}',
        '{"op":"subscribe"}',
        '{"op":"subscribe","subscriptions":[{"id":-1,"channelId":1}]}',
        '{"op":"subscribe","subscriptions":[{"id":4294967296,"channelId":1}]}',
        '{"op":"subscribe","subscriptions":[{"id":"1","channelId":1}]}',
        '{"op":"unsubscribe","subscriptionIds":[1.5]}',
        '{"op":"unsubscribe","subscriptionIds":' + json.dumps([0] * 10_001) + "}",
        '{"op":"getParameters","parameterNames":["' + "x" * 2000 + '"]}',
        '{"op":"fetchAsset","uri":"' + "[" * 5000 + '","requestId":1}',
        '{"op":"setParameters","parameters":' + "[" * 100_000,
    ],
    ids=repr,
)
def test_what_breaks_the_protocol_is_refused(message: str | bytes) -> None:
    """With one error, whatever it is."""
    with pytest.raises(ProtocolError):
        parse(message)


def test_a_null_is_no_missing_value() -> None:
    """A parameter without `value` is unset; null is a value that fits no parameter."""
    text = '{"op":"setParameters","parameters":[{"name":"a","value":null},{"name":"b"}]}'
    found = parse(text)
    assert isinstance(found, wire.SetParameters)
    assert [each.value for each in found.parameters] == [None, wire.ParameterItem("b").value]


CHANNEL = wire.Channel(1, "/a", "std_msgs/msg/String", "string data\n")
SERVICE = wire.Service(2, "/s", "std_srvs/srv/Trigger", "", "bool success\nstring message\n")


@pytest.mark.parametrize(
    ("sent", "text"),
    [
        (
            wire.server_info("c", ("time",), ("cdr", "json"), "1"),
            (
                '{"op":"serverInfo","name":"c","capabilities":["time"],"supportedEncodings":["cdr","json"],'
                '"metadata":{},"sessionId":"1"}'
            ),
        ),
        (wire.status(wire.WARNING, "w"), '{"op":"status","level":1,"message":"w"}'),
        (wire.status(wire.ERROR, "e", "i"), '{"op":"status","level":2,"message":"e","id":"i"}'),
        (wire.remove_status(["i"]), '{"op":"removeStatus","statusIds":["i"]}'),
        (
            wire.advertise([CHANNEL]),
            (
                '{"op":"advertise","channels":[{"id":1,"topic":"/a","encoding":"cdr",'
                '"schemaName":"std_msgs/msg/String","schema":"string data\\n","schemaEncoding":"ros2msg"}]}'
            ),
        ),
        (wire.unadvertise([1]), '{"op":"unadvertise","channelIds":[1]}'),
        (
            wire.advertise_services([SERVICE]),
            (
                '{"op":"advertiseServices","services":[{"id":2,"name":"/s","type":"std_srvs/srv/Trigger",'
                '"request":{"encoding":"cdr","schemaName":"std_srvs/srv/Trigger_Request",'
                '"schemaEncoding":"ros2msg","schema":""},"response":{"encoding":"cdr",'
                '"schemaName":"std_srvs/srv/Trigger_Response","schemaEncoding":"ros2msg",'
                '"schema":"bool success\\nstring message\\n"}}]}'
            ),
        ),
        (wire.unadvertise_services([2]), '{"op":"unadvertiseServices","serviceIds":[2]}'),
        (
            wire.parameter_values([{"name": "/n.a", "value": 3.0, "type": "float64"}], "x"),
            '{"op":"parameterValues","parameters":[{"name":"/n.a","value":3.0,"type":"float64"}],"id":"x"}',
        ),
        (wire.parameter_values([]), '{"op":"parameterValues","parameters":[]}'),
        (
            wire.connection_graph_update({"/a": ("/n",)}, {}, {"/s": ("/n",)}, ["/b"], []),
            (
                '{"op":"connectionGraphUpdate","publishedTopics":[{"name":"/a","publisherIds":["/n"]}],'
                '"subscribedTopics":[],"advertisedServices":[{"name":"/s","providerIds":["/n"]}],'
                '"removedTopics":["/b"],"removedServices":[]}'
            ),
        ),
        (
            wire.service_call_failure(2, 8, "no"),
            '{"op":"serviceCallFailure","serviceId":2,"callId":8,"message":"no"}',
        ),
    ],
)
def test_texts_of_the_server(sent: bytes, text: str) -> None:
    """Each operation, exactly."""
    assert sent.decode() == text


def test_bytes_of_the_server() -> None:
    """Little-endian, exactly."""
    assert wire.message_data(0x102, 0x304, b"ab") == b"\x01\x02\x01\0\0\x04\x03" + bytes(6) + b"ab"
    assert wire.time(0x304) == b"\x02\x04\x03" + bytes(6)
    call = ServiceCall(7, 8, "json", b"")
    assert wire.service_call_response(call, b"{}") == b"\x03\x07\0\0\0\x08\0\0\0\x04\0\0\0json{}"
    assert wire.asset(9, b"file") == b"\x04\x09\0\0\0\0\0\0\0\0file"
    assert wire.asset_failure(9, "no") == b"\x04\x09\0\0\0\x01\x02\0\0\0no"


def test_frames_are_those_of_foxglove_sdk() -> None:
    """What a server of foxglove-sdk 0.30.3 sent a client, which depends on names and types, not on order."""
    values: list[dict[str, Any]] = [
        {"name": "/n.a", "type": "float64", "value": 3.0},
        {"name": "/n.c", "type": "byte_array", "value": "YWI="},
        {"name": "/n.d", "type": "float64_array", "value": [1.0, 2.0]},
    ]
    call = ServiceCall(1, 5, "cdr", b"")
    for sent, text in (
        (
            wire.advertise([wire.Channel(1, "/a", "std_msgs/msg/String", "string data\n")]),
            (
                '{"op":"advertise","channels":[{"id":1,"topic":"/a","encoding":"cdr","schemaName":'
                '"std_msgs/msg/String","schemaEncoding":"ros2msg","schema":"string data\\n"}]}'
            ),
        ),
        (
            wire.parameter_values(values, "q"),
            (
                '{"op":"parameterValues","parameters":[{"name":"/n.a","type":"float64","value":3.0},{"name":"/n.c",'
                '"type":"byte_array","value":"YWI="},{"name":"/n.d","type":"float64_array","value":[1.0,2.0]}],"id":"q"}'
            ),
        ),
        (
            wire.service_call_failure(99, 5, "Unknown service"),
            '{"op":"serviceCallFailure","serviceId":99,"callId":5,"message":"Unknown service"}',
        ),
    ):
        assert json.loads(sent) == json.loads(text)
    assert wire.time(77) == b"\x02M\0\0\0\0\0\0\0"
    assert wire.asset(1, b"file") == b"\x04\x01\0\0\0\0\0\0\0\0file"
    assert wire.asset_failure(2, "OSError: not found") == b"\x04\x02\0\0\0\x01\x12\0\0\0OSError: not found"
    assert wire.service_call_response(call, b"resp") == b"\x03\x01\0\0\0\x05\0\0\0\x03\0\0\0cdrresp"
    assert wire.message_data(0, 5, b"abc") == b"\x01\0\0\0\0\x05\0\0\0\0\0\0\0abc"
