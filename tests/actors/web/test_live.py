"""What a page gets over its WebSocket."""

from __future__ import annotations

import asyncio
import itertools
import time
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

import pytest

from actors.interfaces.action_tutorials_interfaces.action import Fibonacci as CountTo
from actors.interfaces.builtin_interfaces.msg import Time
from actors.interfaces.example_interfaces.action import Fibonacci
from actors.interfaces.example_interfaces.srv import AddTwoInts
from actors.interfaces.geometry_msgs.msg import PointStamped, Twist, Vector3
from actors.interfaces.message import type_name
from actors.interfaces.std_msgs.msg import Header, Int32, String
from actors.interfaces.std_srvs.srv import Trigger
from actors.interfaces.tf2_msgs.msg import TFMessage
from actors.qos.profile import QoSProfile, ReliabilityPolicy
from actors.web import observer
from actors.web.live import graph_panel
from actors.web.live.echo_panel import MESSAGES_PER_UPDATE
from actors.web.live.session import MAX_PANELS, MAX_REQUEST_BYTES
from tests.actors.meeting import DEADLINE_SEC, latched, until
from tests.actors.web.site import Page
from tests.hostile.decode_bytes import starved

if TYPE_CHECKING:
    from collections.abc import AsyncIterator

    from tests.actors.meeting import Meeting
    from tests.actors.web.site import Site


@pytest.fixture
async def page(site: Site) -> AsyncIterator[Page]:
    """A page that has just connected."""
    async with site.client.ws_connect("/api/live") as socket:
        yield Page(socket)


@pytest.mark.parametrize("name", ["Upgrade", "Connection", "Sec-WebSocket-Version", "Sec-WebSocket-Key"])
@pytest.mark.parametrize("value", ["\u00be" * 8, "\udcff", "A"], ids=["latin", "bytes", "wrong"])
async def test_a_wrong_handshake_is_refused(site: Site, name: str, value: str) -> None:
    """Case 74: a header of the WebSocket with other characters than ASCII is a bad request, not an error."""
    headers = {
        "Host": "localhost",
        "Upgrade": "websocket",
        "Connection": "Upgrade",
        "Sec-WebSocket-Version": "13",
        "Sec-WebSocket-Key": "A" * 22 + "==",
        name: value,
    }
    head = "".join(f"{each}: {text}\r\n" for each, text in headers.items())
    reader, writer = await asyncio.open_connection("127.0.0.1", site.server.port)
    writer.write(f"GET /api/live HTTP/1.1\r\n{head}\r\n".encode(errors="surrogateescape"))
    assert (await reader.readline()).split()[1] == b"400"
    writer.close()


async def test_the_graph_panel_sends_what_changes(page: Page, meeting: Meeting) -> None:
    """First everything, then a node that comes, then one that goes, as null."""
    await page.open(1, "graph")
    first = await page.next()
    assert first["id"] == 1
    assert first["patch"]["vertices"] == {}
    node = await meeting.node("talker")
    node.create_publisher(String, "chatter", 1)
    found = await page.until(lambda body: "topic /chatter" in body["patch"].get("vertices", {}))
    assert found["patch"]["vertices"]["topic /chatter"]["types"] == ["std_msgs/msg/String"]
    await node.__aexit__(None, None, None)
    await page.until(lambda body: body["patch"].get("vertices", {}).get("node /talker", 0) is None)


async def test_a_pause_of_the_machine_does_not_hold_up_the_graph(
    page: Page, meeting: Meeting, monkeypatch: pytest.MonkeyPatch
) -> None:
    """After a change that keeps the loop busy the next one waits; a pause keeps nothing busy."""
    seconds = itertools.count(step=100.0)
    clocks = SimpleNamespace(monotonic=lambda: next(seconds), thread_time=time.thread_time)
    monkeypatch.setattr(observer, "time", clocks)
    await page.open(1, "graph")
    for name in ("one", "two"):
        await meeting.node(name)
        while f"node /{name}" not in (await page.next())["patch"].get("vertices", {}):
            pass


async def test_the_graph_panel_marks_what_does_not_match(page: Page, meeting: Meeting) -> None:
    """Topics, services and actions whose types differ: their edges, and why."""
    server, caller = await meeting.node("server"), await meeting.node("caller")
    server.create_subscription(String, "chatter", print, 1)
    server.create_service(Trigger, "do", lambda request, response: response)
    server.create_action_server(Fibonacci, "count", lambda goal: Fibonacci.Result())
    caller.create_publisher(Int32, "chatter", 1)
    caller.create_client(AddTwoInts, "do")
    caller.create_action_client(CountTo, "count")
    await page.open(1, "graph", services=True, actions=True)
    found: dict[str, Any] = {"edges": {}, "mismatches": {}}
    while len(found["mismatches"]) < 3:
        patch = (await page.next())["patch"]
        found = {part: {**known, **patch.get(part, {})} for part, known in found.items()}
    assert {edge for edge, each in found["edges"].items() if each.get("mismatch")} == {
        "node /caller publishes topic /chatter",
        "topic /chatter subscribes node /server",
        "node /caller calls service /do",
        "service /do serves node /server",
        "node /caller calls action /count",
        "action /count serves node /server",
    }
    assert found["mismatches"]["node /caller action /count node /server"]["text"] == (
        f"Not connected, as their types differ: /caller calls /count as {type_name(CountTo)},"
        " /server serves it as example_interfaces/action/Fibonacci"
    )


async def test_the_broker_panel_says_whether_there_is_a_broker(page: Page, meeting: Meeting) -> None:
    """It ends, and there is another one at the same place."""
    await page.open(1, "broker")
    assert (await page.next())["patch"] == {"connected": True, "target": f"{meeting.url} domain 0"}
    await meeting.stop_broker()
    assert (await page.next())["patch"] == {"connected": False}
    await meeting.restart_broker()
    assert (await page.next())["patch"] == {"connected": True}


async def test_the_overview_panel_sends_rates(page: Page, meeting: Meeting) -> None:
    """A topic's row is there as soon as a sample was taken."""
    node = await meeting.node("talker")
    node.create_publisher(String, "chatter", 1)
    await page.open(7, "overview")
    found = await page.until(lambda body: "/chatter" in body["patch"].get("topics", {}))
    assert found["id"] == 7
    assert found["patch"]["topics"]["/chatter"]["publishers"] == 1


async def test_rates_after_a_pause_are_not_those_of_the_pause(
    page: Page, site: Site, meeting: Meeting, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Nobody has looked for long: the first numbers have no rates."""
    monkeypatch.setattr(observer, "MAX_SAMPLE_GAP_SEC", -1.0)
    monkeypatch.setattr(observer, "MIN_RATE_SEC", 0.0)
    node = await meeting.node("talker")
    node.create_publisher(String, "chatter", 1)
    await site.json_until("/api/overview", lambda found: found["topics"] and found["interval_sec"])
    await page.open(1, "overview")
    found = await page.until(lambda body: "/chatter" in body["patch"].get("topics", {}))
    assert found["patch"]["topics"]["/chatter"]["messages_per_sec"] is None
    await page.until(lambda body: body["patch"]["topics"]["/chatter"].get("messages_per_sec") is not None)


async def test_the_panels_of_a_service_and_an_action_follow_their_servers(
    page: Page, meeting: Meeting
) -> None:
    """Nothing before there is one; then its type and who serves it."""
    await page.open(1, "service", name="/add")
    await page.open(2, "action", name="/count")
    assert [(await page.next())["patch"] for _ in range(2)] == [{}, {}]
    node = await meeting.node("server")
    node.create_service(AddTwoInts, "add", lambda _, response: response)
    found = await page.until(lambda body: body["id"] == 1 and body["patch"].get("servers"))
    assert [each["node"] for each in found["patch"]["servers"]] == ["/server"]
    node.create_action_server(Fibonacci, "count", lambda _: Fibonacci.Result())
    found = await page.until(lambda body: body["id"] == 2 and body["patch"].get("servers"))
    assert found["patch"]["types"] == ["example_interfaces/action/Fibonacci"]


async def test_a_slow_page_gets_the_newest_messages_and_the_number_of_the_others(
    page: Page, meeting: Meeting
) -> None:
    """More messages than an update holds, published in one go."""
    node = await meeting.node("talker")
    publisher = node.create_publisher(String, "chatter", 1000)
    await page.open(1, "echo", topic="/chatter")
    await until(publisher.get_subscription_count)
    for number in range(500):
        publisher.publish(String(data=str(number)))
    shown: list[str] = []
    skipped = 0
    while not shown or shown[-1] != "499":
        body = await page.next()
        assert len(body["messages"]) <= MESSAGES_PER_UPDATE
        shown += [each["message"]["data"] for each in body["messages"]]
        skipped += body["skipped"]
    assert len(shown) + skipped == 500
    assert shown == sorted(shown, key=int)


async def test_an_echo_of_one_type_leaves_the_others_out(page: Page, site: Site, meeting: Meeting) -> None:
    """Where two nodes publish other types on one topic; a type that none of them has leaves all out."""
    texts = (await meeting.node("texts")).create_publisher(String, "mixed", latched(1))
    numbers = (await meeting.node("numbers")).create_publisher(Int32, "mixed", latched(1))
    await site.json_until("/api/topics", lambda found: any(len(each["types"]) == 2 for each in found))
    await page.open(1, "echo", topic="/mixed", type="std_msgs/msg/Int32")
    await page.open(2, "echo", topic="/mixed", type="std_msgs/msg/Bool")
    await page.open(3, "echo", topic="/mixed")
    texts.publish(String(data="a"))
    numbers.publish(Int32(data=1))
    found: dict[int, list[Any]] = {1: [], 2: [], 3: []}
    while len(found[1]) < 1 or len(found[3]) < 2:
        body = await page.next()
        found[body["id"]] += [each["message"]["data"] for each in body["messages"]]
    assert (found[1], found[2], set(found[3])) == ([1], [], {"a", 1})


async def test_delays_are_measured_by_header_or_since_the_messages_were_sent(
    page: Page, meeting: Meeting
) -> None:
    """Once a second; what is older than the question, such as a latched message, does not count."""
    node = await meeting.node("talker")
    stamped = node.create_publisher(PointStamped, "stamped", 1)
    plain = node.create_publisher(String, "plain", 1)
    old = node.create_publisher(String, "old", latched(1))
    old.publish(String())
    await page.open(1, "delays", topics=["/stamped", "/plain", "/old"])
    await until(lambda: all(each.get_subscription_count() for each in (stamped, plain, old)))
    header = Header(stamp=Time(sec=int(time.time()) - 1000))
    stamped.publish(PointStamped(header=header))
    plain.publish(String())
    delays: dict[str, float] = {}
    while len(delays) < 2:
        delays |= (await page.next())["patch"].get("delays", {})
    assert delays.keys() == {"/stamped", "/plain"}
    assert 999 < delays["/stamped"] < 1000 + DEADLINE_SEC
    assert 0 <= delays["/plain"] < DEADLINE_SEC
    await page.socket.send_json({"close": 1})
    await until(lambda: not stamped.get_subscription_count())


async def test_delays_that_cannot_be_measured_leave_nothing_open(page: Page, meeting: Meeting) -> None:
    """A wrong name among others; too many."""
    publisher = (await meeting.node("talker")).create_publisher(String, "chatter", 1)
    await page.open(1, "delays", topics=["/chatter", "not a name"])
    assert "not a name" in (await page.next())["error"]
    await page.open(2, "delays", topics=["/chatter"] * 65)
    assert "64" in (await page.next())["error"]
    await page.open(3, "delays", topics=["/chatter", "/chatter"])
    await until(publisher.get_subscription_count)
    await page.socket.send_json({"close": 3})
    await until(lambda: not publisher.get_subscription_count())


async def test_an_echo_has_the_delay_by_the_header(page: Page, meeting: Meeting) -> None:
    """If the stamp is set."""
    publisher = (await meeting.node("talker")).create_publisher(PointStamped, "stamped", latched(2))
    publisher.publish(PointStamped())
    publisher.publish(PointStamped(header=Header(stamp=Time(sec=int(time.time()) - 1000))))
    await page.open(1, "echo", topic="/stamped")
    found: list[dict[str, Any]] = []
    while len(found) < 2:
        found += (await page.next())["messages"]
    assert "header_delay_sec" not in found[0]
    assert 999 < found[1]["header_delay_sec"] < 1000 + DEADLINE_SEC


@pytest.mark.parametrize("opened_first", [False, True])
async def test_messages_of_a_strict_publisher_are_shown_whenever_it_comes(
    page: Page, meeting: Meeting, *, opened_first: bool
) -> None:
    """It is BEST_EFFORT, and comes before the page or after a publisher that keeps messages."""
    node = await meeting.node("talker")
    best_effort = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)
    if opened_first:
        node.create_publisher(String, "chatter", latched(1)).publish(String(data="kept"))
        await page.open(1, "echo", topic="/chatter")
        await page.next()
    publisher = node.create_publisher(String, "chatter", best_effort, strict_qos=True)
    if not opened_first:
        await page.open(1, "echo", topic="/chatter")
    await until(publisher.get_subscription_count)
    publisher.publish(String(data="new"))
    assert (await page.next())["messages"][-1]["message"] == {"data": "new"}


async def test_a_closed_panel_sends_nothing_more(page: Page, meeting: Meeting) -> None:
    """And its topic is no longer subscribed to; its number can be used again."""
    node = await meeting.node("talker")
    publisher = node.create_publisher(String, "chatter", 1)
    await page.open(1, "echo", topic="/chatter")
    await until(publisher.get_subscription_count)
    await page.socket.send_json({"close": 1})
    await until(lambda: not publisher.get_subscription_count())
    await page.open(1, "nothing")
    assert "There is no panel" in (await page.next())["error"]


@pytest.mark.parametrize(
    ("request_text", "error"),
    [
        ("nonsense", "Not a JSON object"),
        ("[1]", "Not a JSON object"),
        ('{"open": "1", "panel": "graph"}', "number"),
        ('{"open": 5, "panel": "echo"}', "topic"),
        ('{"open": 5, "panel": "echo", "topic": "/a", "more": 1}', "more"),
        ('{"open": 5, "panel": "echo", "topic": "not a name"}', "not a name"),
        ('{"open": 5, "panel": "graph", "hidden": "yes"}', "bool"),
    ],
)
async def test_a_wrong_request_is_answered_with_an_error(page: Page, request_text: str, error: str) -> None:
    """And the connection goes on."""
    await page.socket.send_str(request_text)
    assert error in (await page.next())["error"]
    await page.open(9, "graph")
    assert (await page.next())["id"] == 9


async def test_a_page_has_a_limited_number_of_panels(page: Page) -> None:
    """The next one is refused."""
    for number in range(MAX_PANELS + 1):
        await page.open(number, "graph")
    found = await page.until(lambda body: "error" in body)
    assert found["id"] == MAX_PANELS


async def test_a_request_that_is_too_long_ends_the_connection(page: Page) -> None:
    """Before it is all in memory."""
    await page.socket.send_str("x" * (MAX_REQUEST_BYTES + 1))
    await page.socket.receive()
    assert page.socket.closed


async def test_a_plot_gets_points_of_numbers(page: Page, meeting: Meeting) -> None:
    """Null where a message has no such number."""
    node = await meeting.node("talker")
    publisher = node.create_publisher(Twist, "wave", 10)
    await page.open(1, "plot", topic="/wave", fields=["linear.x", "linear.nothing", "angular"])
    await until(publisher.get_subscription_count)
    publisher.publish(Twist(linear=Vector3(x=1.5)))
    publisher.publish(Twist(linear=Vector3(x=float("nan"))))
    points: list[list[float | None]] = []
    while len(points) < 2:
        points += (await page.next())["points"]
    assert [point[1:] for point in points] == [[1.5, None, None], [None, None, None]]
    assert all(point[0] for point in points)


@pytest.mark.parametrize("fields", [[], ["a b"], ["x"] * 17])
async def test_a_plot_needs_a_few_fields(page: Page, fields: list[str]) -> None:
    """Paths of fields, sixteen at most."""
    await page.open(1, "plot", topic="/wave", fields=fields)
    assert "error" in await page.next()


async def test_services_and_actions_are_drawn_if_they_are_wanted(page: Page, meeting: Meeting) -> None:
    """With edges from clients and to servers."""
    node = await meeting.node("server")
    node.create_service(AddTwoInts, "add", lambda request, response: response)
    node.create_action_server(Fibonacci, "fibonacci", lambda goal: Fibonacci.Result())
    await page.open(1, "graph", services=True, actions=True)
    found: dict[str, str] = {}
    while not {"service /add", "action /fibonacci"} <= found.keys():
        patch = (await page.next())["patch"]
        found |= {edge["source"]: edge["target"] for edge in patch.get("edges", {}).values()}
    assert found["service /add"] == found["action /fibonacci"] == "node /server"


async def test_a_topic_panel_has_its_ends_and_rates(page: Page, meeting: Meeting) -> None:
    """And nothing while there is no such topic."""
    await page.open(1, "topic", topic="/chatter")
    assert (await page.next())["patch"] == {}
    node = await meeting.node("talker")
    node.create_publisher(String, "chatter", 3)
    body = await page.until(lambda body: "publishers" in body["patch"])
    assert body["patch"]["types"] == ["std_msgs/msg/String"]
    await page.until(lambda body: "rates" in body["patch"])


async def test_more_vertices_than_a_page_draws_are_counted(
    page: Page, meeting: Meeting, monkeypatch: pytest.MonkeyPatch
) -> None:
    """And so are no edges to them."""
    monkeypatch.setattr(graph_panel, "MAX_VERTICES", 1)
    node = await meeting.node("talker")
    for number in range(3):
        node.create_publisher(String, f"topic{number}", 1)
    await page.open(1, "graph")
    body = await page.until(lambda body: body["patch"].get("omitted") == 3)
    assert body["patch"].get("edges", {}) == {}


@pytest.mark.parametrize("known", [True, False])
async def test_an_echo_refuses_what_leaves_out_too_much(page: Page, meeting: Meeting, known: bool) -> None:
    """Case 62: it says so in the place of the message, and the next one is shown."""
    node = await meeting.node("talker")
    publisher = node.create_publisher(TFMessage, "tf", 10)
    if not known:  # two types on one topic: messages are read as dicts
        node.create_publisher(String, "tf", 10)
    await page.open(1, "echo", topic="/tf")
    await until(publisher.get_subscription_count)
    publisher.publish_encoded(starved("transforms", 100_000))
    publisher.publish(TFMessage())
    shown: list[dict[str, Any]] = []
    while len(shown) < 2:
        shown += (await page.next())["messages"]
    assert "would take more than" in shown[0]["error"]
    assert shown[1]["message"] == {"transforms": []}
