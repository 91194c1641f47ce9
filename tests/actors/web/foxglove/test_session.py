"""What follows from the messages of one client, and what it is sent."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

from actors.web.foxglove import messages as wire
from actors.web.foxglove import session as module
from actors.web.foxglove.answers import MAX_ANSWERS, MAX_STATUS_CHARACTERS, MAX_STATUSES, Frame
from actors.web.foxglove.messages import Channel, Service
from actors.web.foxglove.session import (
    Call,
    ClosePublisher,
    CloseSubscription,
    Connections,
    Due,
    OpenPublisher,
    OpenSubscription,
    Publish,
    Session,
)

if TYPE_CHECKING:
    import pytest

CHANNELS = {
    number: Channel(number, f"/t{number}", "std_msgs/msg/String", "string data\n") for number in (1, 2)
}
SERVICES = {7: Service(7, "/s", "std_srvs/srv/Trigger", "", "bool success\nstring message\n")}
READ_ONLY = "This server is read-only"


def sent(session: Session[str]) -> list[Any]:
    """Return what is sent: documents of texts, bytes, and messages that are due."""
    found = list[Any]()
    while item := session.next():
        if isinstance(item, Frame):
            found.append(json.loads(item.data) if item.is_text else item.data)
        else:
            found.append(item)
    return found


def texts(session: Session[str]) -> list[str]:
    """Return the texts of the statuses that are sent."""
    return [each["message"] for each in sent(session) if isinstance(each, dict) and each["op"] == "status"]


def begun(refusal: str = "") -> Session[str]:
    """Return a session whose client knows the channels and services."""
    session = Session[str]("callboard", "s", refusal)
    session.set_channels(CHANNELS)
    session.set_services(SERVICES)
    sent(session)
    return session


def text(op: str, **fields: Any) -> str:
    return json.dumps({"op": op, **fields})


def subscribe(session: Session[str], *pairs: tuple[int, int]) -> list[Any]:
    items = [{"id": number, "channelId": channel} for number, channel in pairs]
    return [*session.receive(text("subscribe", subscriptions=items))]


def test_a_client_gets_the_server_info_first() -> None:
    """Then at least one announcement, also if there is nothing to announce."""
    session = Session[str]("callboard", "s", READ_ONLY)
    session.set_channels({})
    info, channels = sent(session)
    assert info == {
        "op": "serverInfo",
        "name": "callboard",
        "capabilities": ["parameters", "parametersSubscribe", "connectionGraph", "assets"],
        "supportedEncodings": [],
        "metadata": {},
        "sessionId": "s-0",
    }
    assert channels == {"op": "advertise", "channels": []}


def test_who_may_control_is_offered_more() -> None:
    """Publishing and calls, and the encodings for them."""
    session = Session[str]("callboard", "s", "")
    session.set_services(SERVICES)
    info, services = sent(session)
    assert {"clientPublish", "services"} <= {*info["capabilities"]}
    assert info["supportedEncodings"] == ["cdr", "json"]
    assert [each["id"] for each in services["services"]] == [7]
    read_only = Session[str]("callboard", "s", READ_ONLY)
    read_only.set_services(SERVICES)
    assert len(sent(read_only)) == 1


def test_a_clock_changes_what_the_server_says_of_itself() -> None:
    """With a clock times are its times, so that the client must forget what it has received."""
    session = begun()
    session.set_clock(present=True)
    session.set_time(5)
    session.set_time(6)
    info, time = sent(session)
    assert "time" in info["capabilities"]
    assert info["sessionId"] == "s-1"
    assert time == wire.time(6)
    session.set_clock(present=True)
    assert sent(session) == []
    session.set_clock(present=False)
    (info,) = sent(session)
    assert "time" not in info["capabilities"]
    assert info["sessionId"] == "s-2"


def test_channels_are_announced_in_pieces() -> None:
    """A thousand at once are no single text, and what is gone before it is announced never is."""
    many = {number: Channel(number, f"/t{number}", "p/msg/T", "") for number in range(10, 1010)}
    session = begun()
    session.set_channels({})
    session.set_channels(many)
    session.set_channels({number: many[number] for number in range(10, 260)})
    gone, *new = sent(session)
    assert gone == {"op": "unadvertise", "channelIds": [1, 2]}
    assert [len(each["channels"]) for each in new] == [100, 100, 50]


def test_a_channel_that_vanishes_ends_its_subscription() -> None:
    """The others go on, and it may come back under the same number."""
    session = begun()
    assert subscribe(session, (0, 1), (5, 2)) == [
        OpenSubscription(0, CHANNELS[1]),
        OpenSubscription(5, CHANNELS[2]),
    ]
    session.add_message(0, "lost", 1)
    session.add_message(5, "kept", 1)
    assert session.set_channels({2: CHANNELS[2]}) == [CloseSubscription(0)]
    assert sent(session) == [{"op": "unadvertise", "channelIds": [1]}, Due(5, CHANNELS[2], "kept")]
    session.set_channels(CHANNELS)
    assert [each["id"] for each in sent(session)[0]["channels"]] == [1]
    assert subscribe(session, (0, 1)) == [OpenSubscription(0, CHANNELS[1])]


def test_wrong_subscriptions_are_reported() -> None:
    """One text for a whole list, and the rest of the list counts."""
    session = begun()
    assert subscribe(session, (0, 1)) == [OpenSubscription(0, CHANNELS[1])]
    assert subscribe(session, (0, 2), (1, 1), (2, 9), (3, 2)) == [OpenSubscription(3, CHANNELS[2])]
    assert texts(session) == ["There is a subscription 0 already (and 2 more problems)"]
    assert session.receive(text("unsubscribe", subscriptionIds=[0, 77])) == [CloseSubscription(0)]
    assert texts(session) == []


def test_subscriptions_have_a_limit(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of one client."""
    monkeypatch.setattr(module, "MAX_SUBSCRIPTIONS", 1)
    session = begun()
    assert len(subscribe(session, (0, 1), (1, 2))) == 1
    assert texts(session) == ["1 channels are subscribed to already"]


def test_a_flood_leaves_the_message_of_another_channel() -> None:
    """Its oldest are dropped, counted and reported; the latched message of the other is sent second."""
    session = begun()
    subscribe(session, (0, 1), (1, 2))
    for number in range(5000):
        session.add_message(0, str(number), 256)
    session.add_message(1, "map", 10, b"publisher")
    for number in range(5000):
        session.add_message(0, str(number), 256)
    assert session.report_drops() == 9000
    report, first, second, *rest = sent(session)
    assert report["id"] == "callboard.drops"
    assert report["message"].startswith("This client reads too slowly: 9000 messages of '/t1' were dropped")
    assert first.message == "4000"
    assert second == Due(1, CHANNELS[2], "map")
    assert rest[-1].message == "4999"
    assert session.report_drops() == 0


def test_a_client_publishes() -> None:
    """On channels that it has advertised, in an encoding that the server knows."""
    session = begun()
    channels = [
        {"id": 3, "topic": "/a", "encoding": "json", "schemaName": "std_msgs/String"},
        {"id": 4, "topic": "/b", "encoding": "protobuf", "schemaName": "x"},
        {"id": 3, "topic": "/c", "encoding": "cdr", "schemaName": "std_msgs/String"},
    ]
    (opened,) = session.receive(text("advertise", channels=channels))
    assert isinstance(opened, OpenPublisher)
    assert texts(session) == ["'/b': the encoding is none of cdr, json (and 1 more problems)"]
    assert session.receive(b"\x01\x03\0\0\0{}") == [Publish(opened.channel, b"{}")]
    assert session.receive(text("unadvertise", channelIds=[3, 4])) == [ClosePublisher(3)]
    assert session.receive(b"\x01\x03\0\0\0{}") == []
    assert texts(session) == ["There is no client's channel 3"]


def test_a_client_calls() -> None:
    """Each call has one answer, also if it is refused."""
    session = begun()
    request = wire.ServiceCall(7, 1, "json", b"{}")
    assert session.receive(b"\x02\x07\0\0\0\x01\0\0\0\x04\0\0\0json{}") == [Call(SERVICES[7], request)]
    session.finish_call(wire.service_call_response(request, b"{}"), is_text=False)
    assert sent(session) == [b"\x03\x07\0\0\0\x01\0\0\0\x04\0\0\0json{}"]
    session.receive(b"\x02\x08\0\0\0\x02\0\0\0\x04\0\0\0json{}")
    session.receive(b"\x02\x07\0\0\0\x03\0\0\0\x03\0\0\0xml")
    assert [each["message"] for each in sent(session)] == [
        "There is no service 8",
        "The encoding is none of cdr, json",
    ]
    for _ in range(module.MAX_CALLS + 1):
        session.receive(b"\x02\x07\0\0\0\x03\0\0\0\x03\0\0\0cdr")
    assert [each["message"] for each in sent(session)] == ["64 calls wait for their responses already"]


def test_who_may_read_only_is_refused() -> None:
    """Publishing, calls and setting parameters; reading parameters is allowed."""
    session = begun(READ_ONLY)
    channels = [{"id": 3, "topic": "/a", "encoding": "json", "schemaName": "std_msgs/String"}]
    assert session.receive(text("advertise", channels=channels)) == []
    assert session.receive(text("setParameters", parameters=[], id="a")) == []
    assert texts(session) == [READ_ONLY]
    assert session.receive(b"\x02\x07\0\0\0\x03\0\0\0\x04\0\0\0json{}") == []
    assert [each["message"] for each in sent(session)] == [READ_ONLY]
    assert session.receive(text("getParameters", parameterNames=[])) == [wire.GetParameters([])]


def test_parameters_are_sent_when_they_change() -> None:
    """Those that the client watches, each once with its newest value."""
    session = begun()
    session.set_parameter("/n.a", {"name": "/n.a", "value": 1})
    session.receive(text("subscribeParameterUpdates", parameterNames=["/n.a", "/n.b"]))
    for value in (2, 3):
        session.set_parameter("/n.a", {"name": "/n.a", "value": value})
        session.set_parameter("/n.c", {"name": "/n.c", "value": value})
    assert sent(session) == [{"op": "parameterValues", "parameters": [{"name": "/n.a", "value": 3}]}]
    session.receive(text("unsubscribeParameterUpdates", parameterNames=["/n.a"]))
    for name in ("/n.a", "/n.b"):
        session.set_parameter(name, {"name": name})
    assert sent(session) == [{"op": "parameterValues", "parameters": [{"name": "/n.b"}]}]
    session.receive(text("subscribeParameterUpdates", parameterNames=[]))
    session.set_parameter("/n.c", {"name": "/n.c"})
    assert sent(session) == [{"op": "parameterValues", "parameters": [{"name": "/n.c"}]}]
    session.receive(text("unsubscribeParameterUpdates", parameterNames=[]))
    session.set_parameter("/n.c", {"name": "/n.c"})
    assert sent(session) == []


def test_all_parameters_but_some_are_watched(monkeypatch: pytest.MonkeyPatch) -> None:
    """A client that watches all may leave some out, a limited number, and watch them again."""
    monkeypatch.setattr(module, "MAX_PARAMETERS", 2)
    session = begun()

    def seen() -> list[str]:
        for name in ("/n.a", "/n.b"):
            session.set_parameter(name, {"name": name})
        return [each["name"] for document in sent(session) for each in document["parameters"]]

    session.receive(text("subscribeParameterUpdates", parameterNames=[]))
    session.receive(text("unsubscribeParameterUpdates", parameterNames=["/n.a", "/n.c"]))
    assert seen() == ["/n.b"]
    session.receive(text("unsubscribeParameterUpdates", parameterNames=["/n.b"]))
    assert texts(session) == ["More than 2 parameters would be left out"]
    session.receive(text("subscribeParameterUpdates", parameterNames=["/n.a"]))
    assert seen() == ["/n.a", "/n.b"]
    session.receive(text("unsubscribeParameterUpdates", parameterNames=[]))
    assert seen() == []


def test_the_graph_is_sent_as_changes() -> None:
    """First all of it; a topic without publishers keeps its subscriptions, one without both is removed."""
    session = begun()
    session.set_graph(Connections({"/a": ("/n",)}, {"/a": ("/m",), "/b": ("/m",)}, {"/s": ("/n",)}))
    assert sent(session) == []
    session.receive(text("subscribeConnectionGraph"))
    (first,) = sent(session)
    assert first["publishedTopics"] == [{"name": "/a", "publisherIds": ["/n"]}]
    assert [each["name"] for each in first["subscribedTopics"]] == ["/a", "/b"]
    assert first["advertisedServices"] == [{"name": "/s", "providerIds": ["/n"]}]
    session.set_graph(Connections({}, {"/a": ("/m",)}, {}))
    (second,) = sent(session)
    assert second == {
        "op": "connectionGraphUpdate",
        "publishedTopics": [{"name": "/a", "publisherIds": []}],
        "subscribedTopics": [],
        "advertisedServices": [],
        "removedTopics": ["/b"],
        "removedServices": ["/s"],
    }
    session.set_graph(Connections({}, {"/a": ("/m",)}, {}))
    assert sent(session) == []
    session.receive(text("unsubscribeConnectionGraph"))
    session.set_graph(Connections())
    assert sent(session) == []


def test_a_flood_of_errors_is_a_few_texts() -> None:
    """Equal ones are one, long ones are cut, and too many are counted."""
    session = begun()
    for _ in range(1000):
        session.receive("x")
    assert len(texts(session)) == 1
    for number in range(MAX_STATUSES + 5):
        subscribe(session, (0, number + 1000))
    assert texts(session)[-1] == "5 further messages of this kind are left out"
    session.answers.report(wire.ERROR, "x" * 10_000)
    assert [len(each) for each in texts(session)] == [MAX_STATUS_CHARACTERS + 1]


def test_answers_that_are_not_read_end_the_reading() -> None:
    """So that a client which only asks cannot fill the memory."""
    session = begun()
    for number in range(MAX_ANSWERS):
        assert not session.answers.are_many
        session.answers.add(str(number).encode())
    assert session.answers.are_many
    session.next()
    assert not session.answers.are_many


def test_files_have_a_limit() -> None:
    """Each request has an answer."""
    session = begun()
    for number in range(module.MAX_FETCHES + 1):
        session.receive(text("fetchAsset", uri="package://p/a", requestId=number))
    (refused,) = sent(session)
    assert refused[:6] == b"\x04\x00\x01\0\0\x01"
    session.finish_fetch(wire.asset(0, b"x"))
    assert session.receive(text("fetchAsset", uri="package://p/a", requestId=1))
