"""Users of a broker with access rules at the web server."""

from __future__ import annotations

import asyncio
import logging
import re
import threading
from contextlib import AsyncExitStack
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import aiohttp
import pytest

from actors.interfaces.rosgraph_msgs.msg import Clock
from actors.interfaces.sensor_msgs.msg import Image
from actors.interfaces.std_msgs.msg import String
from actors.parameters.types import Parameter
from actors.tools import graph_documents
from actors.web import limits, node_watch, observer, users
from actors.web.options import WebOptions
from actors.web.users import NoUsersError
from broker.access.credentials import hash_token
from broker.access.editing import NEW_FILE, add_user
from tests.actors.meeting import DEADLINE_SEC, Meeting, latched, stop_budget_clock, until
from tests.actors.web.foxglove.peer import SDK, Peer
from tests.actors.web.rosbridge.bridge import Bridge
from tests.actors.web.site import Page, Site

if TYPE_CHECKING:
    from collections.abc import AsyncIterator

OPERATOR: Final = "cbt_" + "o" * 43
ZOE: Final = "cbt_" + "z" * 43
NOBODY: Final = "cbt_" + "n" * 43
SERVER: Final = "the-token-of-the-server"

GUIDE: Final = (Path(__file__).resolve().parents[3] / "docs/how-to/browser.md").read_text(encoding="utf-8")

RULES: Final = """
[users.operator]
tokens = ["{operator}"]
roles = ["full"]
[users.zoe]
tokens = ["{zoe}"]
roles = ["zoe"]
[roles.full]
allow.node = ["/**"]
allow.publish = ["/**"]
allow.subscribe = ["/**"]
allow.serve = ["/**"]
allow.see = ["/**"]
allow.administer = ["/**"]
[roles.zoe]
allow.node = ["/**"]
allow.publish = ["/zoe/**"]
allow.subscribe = ["/zoe/**"]
allow.call = ["/zoe/**"]
allow.see = ["/zoe/**", "/camera", "/clock"]
"""


class GuardedSite(Site):
    """A web server whose broker has rules, and requests with tokens."""

    async def answer(
        self, token: str, path: str, status: int = 200, method: str = "GET", **options: Any
    ) -> Any:
        """Return the document that is the answer to somebody with a token (empty: without)."""
        headers = {"Authorization": f"Bearer {token}"} if token else {}
        return await self.json(path, status, method, headers=headers, **options)


@pytest.fixture
def rules(tmp_path: Path) -> Path:
    """A file with two users: the operator and Zoe, who is confined to /zoe."""
    file = tmp_path / "access.toml"
    file.write_text(RULES.format(operator=hash_token(OPERATOR), zoe=hash_token(ZOE)))
    return file


@pytest.fixture
async def guarded(rules: Path, monkeypatch: pytest.MonkeyPatch) -> AsyncIterator[Meeting]:
    """A broker with these rules, and an environment that has the operator's token."""
    monkeypatch.setenv("CALLBOARD_TOKEN", OPERATOR)
    async with AsyncExitStack() as stack:
        meeting = Meeting(stack, auth=rules)
        stop_budget_clock()
        await meeting.open()
        stack.push_async_callback(meeting.stop_broker)
        yield meeting


@pytest.fixture
async def site(guarded: Meeting) -> AsyncIterator[GuardedSite]:
    """A web server where the users sign in, and a graph of which Zoe may see a part."""
    ours = await guarded.node("ours")
    ours.create_publisher(String, "/ours/status")
    zoes = await guarded.node("driver", namespace="/zoe")
    zoes.create_publisher(String, "/zoe/status")
    options = WebOptions(port=0, token=SERVER, allow_control=True, users=True)
    async with AsyncExitStack() as stack:
        site = await GuardedSite(stack, guarded, options).open()
        await until(lambda: len(site.observer.snapshot.nodes()) == 2)
        yield site


def speed_in(news: dict[str, Any]) -> object:
    """Return the value of the parameter `speed` in what a page gets."""
    parameters = (news.get("patch") or {}).get("parameters") or {}
    return parameters.get("by_name", {}).get("speed", {}).get("value")


async def names(site: GuardedSite, token: str) -> set[str]:
    """Return the names of the nodes that somebody sees, as soon as there are any."""
    async with asyncio.timeout(DEADLINE_SEC):
        while not (found := await site.answer(token, "/api/nodes")):
            pass
    return {each["name"] for each in found}


async def test_each_sees_what_the_rules_allow(site: GuardedSite) -> None:
    """The server's own token shows what the server may see; without a token nobody sees anything."""
    assert await names(site, ZOE) == {"/zoe/driver"}
    assert await names(site, SERVER) == {"/ours", "/zoe/driver"}
    await site.answer("", "/api/nodes", 401)
    for token in (NOBODY, "sécret", "x" * 5000):
        assert "no user with this token" in (await site.answer(token, "/api/nodes", 401))["error"]
    assert (await site.answer(ZOE, "/api/session"))["user"] == "zoe"
    assert (await site.answer(SERVER, "/api/session"))["user"] == "operator"


async def test_foxglove_does_what_the_rules_allow(guarded: Meeting) -> None:
    """With a user's token in the address it sees and publishes what that user may; without one nothing."""
    zoes = await guarded.node("driver", namespace="/zoe")
    zoes.create_publisher(String, "/zoe/status")
    (await guarded.node("ours")).create_publisher(String, "/ours/status")
    options = WebOptions(port=0, allow_control=True, users=True, page=False, tools=("foxglove",))
    async with AsyncExitStack() as stack:
        site = await GuardedSite(stack, guarded, options).open()
        async with site.client.get("/", headers={"Sec-WebSocket-Protocol": SDK}) as refused:
            assert refused.status == 401
        socket = await stack.enter_async_context(site.client.ws_connect(f"/?token={ZOE}", protocols=[SDK]))
        peer = Peer(socket)
        await peer.until(lambda: "/zoe/status" in peer.channels)
        channels = [
            {"id": number, "topic": topic, "encoding": "json", "schemaName": "std_msgs/String"}
            for number, topic in enumerate(("/zoe/cmd", "/ours/cmd"))
        ]
        await peer.send("advertise", channels=channels)
        await peer.until(lambda: "/zoe/cmd" in peer.channels and peer.statuses)
        assert peer.statuses[0].startswith("'/ours/cmd': ")
        assert "/ours/status" not in peer.channels


async def test_each_client_of_foxglove_hears_what_the_rules_refuse(
    guarded: Meeting, caplog: pytest.LogCaptureFixture
) -> None:
    """Of topics that it sees and may not read, also if another client of its user has asked before."""
    (await guarded.node("driver", namespace="/zoe")).create_publisher(String, "/camera")
    options = WebOptions(port=0, users=True, page=False, tools=("foxglove",))
    async with AsyncExitStack() as stack:
        site = await GuardedSite(stack, guarded, options).open()
        for _ in range(2):
            address = f"/?token={ZOE}"
            peer = Peer(await stack.enter_async_context(site.client.ws_connect(address, protocols=[SDK])))
            await peer.subscribe("/camera")
            await peer.send("subscribeParameterUpdates", parameterNames=[])
            while len(peer.statuses) < 2:
                await peer.next()
            assert {each.partition(":")[0] for each in peer.statuses} == {"'/camera'", "Parameters"}
    assert "failed" not in caplog.text


async def test_messages_have_wall_time_if_the_rules_refuse_the_clock(guarded: Meeting) -> None:
    """Each client of Foxglove hears of the refusal, once."""
    (await guarded.node("simulator", namespace="/zoe")).create_publisher(Clock, "/clock", 1)
    talker = await guarded.node("talker", namespace="/zoe")
    status = talker.create_publisher(String, "status", latched(1))
    status.publish(String(data="ready"))
    options = WebOptions(port=0, users=True, page=False, tools=("foxglove",))
    async with AsyncExitStack() as stack:
        site = await GuardedSite(stack, guarded, options).open()
        for _ in range(2):
            address = f"/?token={ZOE}"
            peer = Peer(await stack.enter_async_context(site.client.ws_connect(address, protocols=[SDK])))
            while not peer.statuses:
                await peer.next()
            assert peer.statuses[0].startswith("Times are those of this computer, not of '/clock': ")
            await peer.subscribe("/zoe/status")
            assert (await peer.data()).time_ns > 0
            assert len(peer.statuses) == 1


async def test_a_client_of_rosbridge_hears_what_the_rules_refuse(guarded: Meeting) -> None:
    """Before it publishes in vain, or waits for requests."""
    options = WebOptions(port=0, users=True, allow_control=True, page=False, tools=("rosbridge",))
    async with AsyncExitStack() as stack:
        bridge = await Bridge(stack, guarded, options).open()
        client = await bridge.connect(f"/?token={ZOE}")
        await client.send("advertise", id=1, topic="/ours/cmd", type="std_msgs/String")
        await client.send("publish", id=2, topic="/ours/cmd", msg={"data": "x"})
        await client.send("advertise_service", id=3, service="/ours/set", type="std_srvs/SetBool")
        await client.send("advertise_action", id=4, action="/ours/go", type="example_interfaces/Fibonacci")
        for number in (1, 2, 3, 4):
            status = await client.next()
            assert (status["op"], status["id"]) == ("status", number)
        await client.send("advertise", id=5, topic="/zoe/cmd", type="std_msgs/String")
        await client.settled()


async def test_each_does_what_the_rules_allow(site: GuardedSite, guarded: Meeting) -> None:
    """Zoe publishes below /zoe, and nowhere else."""
    heard: list[str] = []
    listener = await guarded.node("listener")

    def hear(message: String) -> None:
        heard.append(message.data)

    for topic in ("/zoe/cmd", "/ours/cmd"):
        listener.create_subscription(String, topic, hear)
    await until(lambda: len(site.observer.snapshot.nodes()) == 3)
    assert (await site.answer(ZOE, "/api/session"))["control"] is True
    document = {"type": "std_msgs/msg/String", "message": {"data": "hi"}}
    await site.answer(ZOE, "/api/topics/zoe/cmd", 200, "POST", json=document)
    await until(lambda: heard)
    refused = await site.answer(ZOE, "/api/topics/ours/cmd", 403, "POST", json=document)
    assert "do not allow 'zoe' to publish on '/ours/cmd'" in refused["error"]
    await site.answer(NOBODY, "/api/topics/zoe/cmd", 401, "POST", json=document)
    assert heard == ["hi"]


async def test_a_topic_that_a_user_may_not_read_says_so(site: GuardedSite) -> None:
    """Echo and plot, in the page and as a stream."""
    refusal = "the access rules do not allow 'zoe' to subscribe to '/ours/status'"
    headers = {"Authorization": f"Bearer {ZOE}"}
    assert (await site.answer(ZOE, "/api/topics/ours/status/echo", 403))["error"] == refusal
    async with site.client.ws_connect("/api/live", headers=headers) as socket:
        page = Page(socket)
        await page.open(1, "echo", topic="/ours/status")
        assert await page.next() == {"id": 1, "error": refusal}
        await page.open(2, "plot", topic="/ours/status", fields=["data"])
        assert await page.next() == {"id": 2, "error": refusal}
        await page.open(3, "log")
        assert await page.next() == {"id": 3, "error": refusal.replace("/ours/status", "/rosout")}
    assert "/rosout" in (await site.answer(ZOE, "/api/log", 403))["error"]


async def test_an_image_that_a_user_may_not_read_is_refused(site: GuardedSite, guarded: Meeting) -> None:
    """Although the topic may be seen."""
    camera = await guarded.node("camera", namespace="/zoe")
    camera.create_publisher(Image, "/camera")
    async with asyncio.timeout(DEADLINE_SEC):
        while "/camera" not in {each["name"] for each in await site.answer(ZOE, "/api/topics")}:
            pass
    refused = await site.answer(ZOE, "/api/topics/camera/image", 403)
    assert refused["error"] == "the access rules do not allow 'zoe' to subscribe to '/camera'"


async def test_a_node_is_asked_for_what_its_user_may_not_hear(
    site: GuardedSite, guarded: Meeting, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Zoe has no right to `/parameter_events`, and sees a changed parameter of her node all the same."""
    monkeypatch.setattr(node_watch, "POLL_PERIOD_SEC", 0.05)
    node = await guarded.node("arm", namespace="/zoe", start_parameter_services=True)
    node.declare_parameter("speed", 1)
    async with site.client.ws_connect("/api/live", headers={"Authorization": f"Bearer {ZOE}"}) as socket:
        page = Page(socket)
        await page.open(1, "node", node="/zoe/arm")
        await page.until(lambda each: speed_in(each) == 1)
        node.set_parameters([Parameter("speed", value=2)])
        await page.until(lambda each: speed_in(each) == 2)


async def test_a_browser_signs_in_and_out_with_a_users_token(site: GuardedSite) -> None:
    """The cookie is enough for the WebSocket, which shows the user's part of the graph."""
    async with aiohttp.ClientSession(site.url, cookie_jar=aiohttp.CookieJar(unsafe=True)) as browser:
        async with browser.post("/api/session", json={"token": NOBODY}) as response:
            assert response.status == 401
        async with browser.post("/api/session", json={"token": ZOE}) as response:
            assert response.status == 200
        async with browser.get("/api/session") as response:  # a cookie alone controls nothing
            assert (await response.json())["control"] is False
        async with browser.ws_connect("/api/live") as socket:
            page = Page(socket)
            await page.open(1, "overview")
            found = await page.until(lambda each: each.get("patch", {}).get("nodes"))
            assert set(found["patch"]["nodes"]) == {"/zoe/driver"}
        async with browser.delete("/api/session") as response:
            assert response.status == 200
        async with browser.get("/api/session") as response:
            assert response.status == 401


async def test_a_user_who_is_gone_is_refused(site: GuardedSite, guarded: Meeting, rules: Path) -> None:
    """Although what the user saw is still known here."""
    assert await names(site, ZOE) == {"/zoe/driver"}
    changed = RULES.format(operator=hash_token(OPERATOR), zoe=hash_token(NOBODY))
    await asyncio.to_thread(rules.write_text, changed)
    guarded.broker.reload()
    async with asyncio.timeout(DEADLINE_SEC):
        while (await site.client.get("/api/nodes", headers={"Authorization": f"Bearer {ZOE}"})).status != 401:
            pass
    assert await names(site, NOBODY) == {"/zoe/driver"}


async def test_workspaces_are_shared_and_close_when_unused(
    site: GuardedSite, guarded: Meeting, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Also those of tokens that the broker has refused."""
    monkeypatch.setattr(users, "IDLE_SEC", 0.0)
    before = guarded.broker.stats().connections
    headers = {"Authorization": f"Bearer {ZOE}"}
    async with site.client.ws_connect("/api/live", headers=headers):
        await asyncio.gather(*(site.answer(ZOE, "/api/nodes") for _ in range(5)))
        assert guarded.broker.stats().connections == before + 1
    await site.answer(NOBODY, "/api/nodes", 401)
    await until(lambda: guarded.broker.stats().connections == before)


async def test_sign_ins_leave_no_loggers(site: GuardedSite, monkeypatch: pytest.MonkeyPatch) -> None:
    """`logging` never forgets a logger, and anybody may try tokens."""
    monkeypatch.setattr(users, "IDLE_SEC", 0.0)
    await site.answer(ZOE, "/api/nodes")
    before = len(logging.root.manager.loggerDict)
    # Ten wrong tokens: the broker answers more of them late.
    for token, status in (((ZOE, 200),) * 3 + ((NOBODY, 401),)) * 10:
        await site.answer(token, "/api/nodes", status)
    # Names of nodes are used again: there are as many as nodes at a time, some of which still end.
    assert len(logging.root.manager.loggerDict) <= before + 8


async def test_the_oldest_unused_workspace_makes_room(
    site: GuardedSite, guarded: Meeting, monkeypatch: pytest.MonkeyPatch
) -> None:
    """One that is used does not: who comes then is asked to wait."""
    monkeypatch.setattr(limits, "MAX_USERS", 1)
    before = guarded.broker.stats().connections
    await site.answer(OPERATOR, "/api/nodes")
    async with site.client.ws_connect("/api/live", headers={"Authorization": f"Bearer {ZOE}"}):
        await until(lambda: guarded.broker.stats().connections == before + 1)
        refused = await site.answer(OPERATOR, "/api/nodes", 503)
        assert refused["error"] == "1 users are signed in already; try again later"


async def status_from(site: GuardedSite, address: str, token: str) -> int:
    """Return the status of the answer to somebody with a token who comes from an address."""
    headers = {"Authorization": f"Bearer {token}"}
    connector = aiohttp.TCPConnector(local_addr=(address, 0))
    async with (
        asyncio.timeout(DEADLINE_SEC),
        aiohttp.ClientSession(site.url, connector=connector, headers=headers) as client,
        client.get("/api/nodes") as response,
    ):
        return response.status


@pytest.mark.parametrize(
    ("address", "attempts"), [("127.0.0.2", 10 + limits.MAX_SIGN_INS + 1), ("127.0.0.3", 14)]
)
async def test_wrong_tokens_keep_nobody_from_signing_in(
    site: GuardedSite, guarded: Meeting, address: str, attempts: int
) -> None:
    """Case 75: the broker answers all after the tenth late; they delay those of their own address at most.

    Whoever has signed in before waits for nobody, whatever the address.
    """
    # No late answer comes during the test.
    guarded.broker.reconfigure(replace(guarded.broker.options, handshake_timeout_sec=1000))
    assert await status_from(site, "127.0.0.2", OPERATOR) == 200
    wrong = [asyncio.create_task(status_from(site, "127.0.0.3", f"{NOBODY}{n}")) for n in range(attempts)]
    await until(lambda: sum(each.done() for each in wrong) == 10)
    assert await status_from(site, address, ZOE) == 200
    assert await status_from(site, "127.0.0.3", OPERATOR) == 200
    assert sum(each.done() for each in wrong) == 10
    for each in wrong:
        each.cancel()
    await asyncio.wait(wrong)


async def test_too_many_wrong_tokens_are_told_when_to_try_again(
    site: GuardedSite, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Case 75: with 429 (RFC 6585), not as if the server were out of order."""
    for n in range(10):
        await site.answer(f"{NOBODY}{n}", "/api/nodes", 401)
    monkeypatch.setattr(observer, "CONNECT_SEC", 0.2)
    headers = {"Authorization": f"Bearer {NOBODY}"}
    async with site.client.get("/api/nodes", headers=headers) as response:
        assert (response.status, response.headers["Retry-After"]) == (429, "60")


async def test_wrong_tokens_take_no_workspace(
    site: GuardedSite, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    """Case 75: of those who are signed in. They are counted, and logged by the limited log only."""
    monkeypatch.setattr(limits, "MAX_USERS", 1)
    async with site.client.ws_connect("/api/live", headers={"Authorization": f"Bearer {ZOE}"}) as socket:
        for n in range(5):
            await site.answer(f"{NOBODY}{n}", "/api/nodes", 401)
        await site.answer(ZOE, "/api/nodes")
        assert not socket.closed
    assert 'callboard_web_refusals_total{reason="tokens"} 5.0' in await metrics(site, SERVER)
    loggers = {each.name for each in caplog.records if each.levelno == logging.WARNING}
    assert loggers <= {"callboard.broker", "callboard.web"}


async def test_who_leaves_is_not_asked_about(
    site: GuardedSite, guarded: Meeting, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Case 75: attempts of clients that do not wait for the answer do not queue up."""
    monkeypatch.setattr(limits, "MAX_SIGN_INS_OF_ADDRESS", 1)
    for n in range(10):
        await site.answer(f"{NOBODY}{n}", "/api/nodes", 401)
    before = guarded.broker.stats()
    gone = [asyncio.create_task(status_from(site, "127.0.0.3", f"{NOBODY}left{n}")) for n in range(10)]
    await until(lambda: guarded.broker.stats().connections > before.connections)
    for each in gone:
        each.cancel()
    await asyncio.wait(gone)
    assert await status_from(site, "127.0.0.3", ZOE) == 200
    assert guarded.broker.stats().unauthorized_connections <= before.unauthorized_connections + 2


async def test_a_broker_without_users_lets_nobody_sign_in(meeting: Meeting) -> None:
    """It would take any token."""
    async with AsyncExitStack() as stack:
        with pytest.raises(NoUsersError, match="start it with --auth"):
            await Site(stack, meeting, WebOptions(port=0, users=True)).open()


async def test_a_broker_that_has_lost_its_users_lets_nobody_sign_in(
    site: GuardedSite, guarded: Meeting
) -> None:
    """Such as after a start without its rules."""
    await guarded.restart_broker()
    await until(lambda: site.observer.connected)
    await site.answer(ZOE, "/api/nodes", 503)


async def metrics(site: Site, token: str = "") -> str:
    """Return what `/metrics` says to somebody with a token (empty: without)."""
    headers = {"Authorization": f"Bearer {token}"} if token else {}
    async with site.client.get("/metrics", headers=headers) as response:
        assert response.status == 200
        return await response.text()


async def test_users_have_metrics_of_what_they_may_see(site: GuardedSite) -> None:
    """Names of topics among them. What the broker withholds is absent: 0 connections would be wrong."""
    for token, seen in ((SERVER, True), (ZOE, False)):
        text = await metrics(site, token)
        assert "callboard_up 1.0" in text
        assert f"callboard_withheld {float(not seen)}" in text
        for name in ('topic="/ours/status"', "callboard_connections ", "callboard_lost_copies_total"):
            assert (name in text) is seen


async def test_the_roles_of_the_guide_have_all_metrics(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The web server's user gets them from the file that `callboard auth add` makes."""
    (line,) = re.findall(r"callboard auth add web (.*)", GUIDE)
    roles = re.findall(r"--role (\w+)", line)
    rules = tmp_path / "access.toml"
    rules.write_text(add_user(NEW_FILE, "web", token=hash_token(OPERATOR), roles=roles, source="new file"))
    monkeypatch.setenv("CALLBOARD_TOKEN", OPERATOR)
    async with AsyncExitStack() as stack:
        meeting = Meeting(stack, auth=rules)
        await meeting.open()
        stack.push_async_callback(meeting.stop_broker)
        site = await Site(stack, meeting).open()
        site.client.headers["Authorization"] = f"Bearer {site.server.token}"
        text = await metrics(site)
        assert "callboard_withheld 0.0" in text
        assert "callboard_connections 1.0" in text
        assert (await site.json("/api/overview"))["totals"]["connections"] == 1


async def test_who_may_not_administer_the_broker_sees_no_zeros(site: GuardedSite) -> None:
    """The totals of the overview are null, and the instance is empty."""
    totals = (await site.answer(ZOE, "/api/overview"))["totals"]
    assert totals.pop("broker") == ""
    assert len(totals) > 10
    assert set(totals.values()) == {None}


async def test_the_first_request_of_a_user_waits_for_the_graph(
    site: GuardedSite, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Case 81: its workspace is opened by the request, and closed when nobody has used it for a while."""
    monkeypatch.setattr(observer, "GRAPH_SEC", DEADLINE_SEC)
    found = await site.answer(ZOE, "/api/nodes")
    assert [each["name"] for each in found] == ["/zoe/driver"]


async def test_all_users_share_a_thread(site: GuardedSite, monkeypatch: pytest.MonkeyPatch) -> None:
    """Case 77: the event loop has one rival for the interpreter, however many users ask at the same time."""
    threads = set[threading.Thread]()
    original = graph_documents.nodes

    def recorded(*args: Any) -> Any:
        threads.add(threading.current_thread())
        return original(*args)

    monkeypatch.setattr(graph_documents, "nodes", recorded)
    for token in (SERVER, OPERATOR, ZOE):
        await site.answer(token, "/api/nodes")
    assert len(threads) == 1


async def test_a_node_that_takes_the_name_of_the_pages_node_is_seen(
    site: GuardedSite, guarded: Meeting
) -> None:
    """Case 80: with its topics, by all who may see them; the page's own nodes are not."""
    await names(site, ZOE)
    own = site.observer.node.get_name()
    assert own not in str(await site.answer(SERVER, "/api/graph"))
    guest = await guarded.node(own, shared_name=True)
    guest.create_publisher(String, "/secret")
    await until(lambda: f"/{own}" in site.observer.snapshot.nodes())
    found = await site.answer(SERVER, "/api/topics/secret")
    assert [each["node"] for each in found["publishers"]] == [f"/{own}"]
    assert (await site.answer(SERVER, f"/api/nodes/{own}"))["publishers"][0]["name"] == "/secret"


@pytest.mark.parametrize("control", [False, True])
async def test_the_page_of_a_broker_with_rules_asks_for_its_token(guarded: Meeting, *, control: bool) -> None:
    """Case 82: also on loopback, where other users of the machine have no token for the broker."""
    async with AsyncExitStack() as stack:
        site = await GuardedSite(stack, guarded, WebOptions(port=0, allow_control=control)).open()
        for path in ("/api/nodes", "/api/overview", "/metrics", "/api/log", "/api/live"):
            await site.answer("", path, 401)
        assert site.server.asks_for_token
        assert site.server.url_with_token == f"{site.url}#token={site.server.token}"
        assert (await site.answer(site.server.token, "/api/session"))["token_needed"] is True
        await site.answer("", "/healthz")


async def test_pages_without_the_token_end_when_the_broker_asks_for_it(
    meeting: Meeting, rules: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Case 82: after a restart with rules; also streams, but none that has shown the token."""
    monkeypatch.setenv("CALLBOARD_TOKEN", OPERATOR)
    async with AsyncExitStack() as stack:
        site = await GuardedSite(stack, meeting).open()
        headers = {"Authorization": f"Bearer {site.server.token}"}
        stays = await stack.enter_async_context(site.client.ws_connect("/api/live", headers=headers))
        ends = await stack.enter_async_context(site.client.ws_connect("/api/live"))
        stream = await stack.enter_async_context(site.client.get("/api/log"))
        await meeting.restart_broker(auth=rules)
        async with asyncio.timeout(DEADLINE_SEC):
            assert (await ends.receive()).type is aiohttp.WSMsgType.CLOSED
            with pytest.raises(aiohttp.ClientError):
                await stream.read()
        await Page(stays).open(1, "nodes")
        assert await Page(stays).next()
        await site.answer("", "/api/nodes", 401)


async def test_reading_without_the_token_may_be_allowed(guarded: Meeting) -> None:
    """Case 82: explicitly, on loopback only."""
    async with AsyncExitStack() as stack:
        options = WebOptions(port=0, read_without_token=True)
        site = await GuardedSite(stack, guarded, options).open()
        await site.answer("", "/api/nodes")
        assert not site.server.asks_for_token
        assert "#" not in site.server.url_with_token
        await site.answer("", "/api/nodes")


async def test_the_page_of_a_broker_on_a_unix_socket_asks_for_its_token(tmp_path: Path) -> None:
    """Case 82: only its owner may open the socket."""
    async with AsyncExitStack() as stack:
        meeting = Meeting(stack, unix=tmp_path / "broker.sock")
        await meeting.open()
        stack.push_async_callback(meeting.stop_broker)
        site = await GuardedSite(stack, meeting).open()
        await site.answer("", "/api/nodes", 401)
        await site.answer(site.server.token, "/api/nodes")


@pytest.mark.parametrize(
    ("origins", "here", "there"),
    [
        ('"127.0.0.1"', True, False),
        ('"127.0.0.2"', False, False),
        ('"127.0.0.1", "127.0.0.2"', True, True),
        ('"local"', True, True),
        ('"192.0.2.0/24"', False, False),
    ],
)
async def test_roles_see_the_address_of_the_browser(
    rules: Path,
    site: GuardedSite,
    guarded: Meeting,
    monkeypatch: pytest.MonkeyPatch,
    origins: str,
    *,
    here: bool,
    there: bool,
) -> None:
    """Case 83: a role applies if it does at the page and at the browser, also for a user at two addresses."""
    monkeypatch.setattr(observer, "GRAPH_SEC", 0.0)  # without the role there is no graph to wait for
    text = rules.read_text().replace("[roles.zoe]", f"[roles.zoe]\nfrom = [{origins}]")  # noqa: ASYNC240 - small
    rules.write_text(text)  # noqa: ASYNC240
    guarded.broker.reload()
    assert [await publishes(site, address) for address in ("127.0.0.1", "127.0.0.2")] == [here, there]


@pytest.mark.parametrize(
    ("origin", "here", "there"), [("127.0.0.1", False, False), ("127.0.0.2", True, False)]
)
async def test_what_a_role_denies_at_the_page_or_at_the_browser_is_denied(
    rules: Path, site: GuardedSite, guarded: Meeting, origin: str, *, here: bool, there: bool
) -> None:
    """Case 83: nobody gets rid of a denial by the address, whichever of the two has it."""
    text = rules.read_text().replace('roles = ["zoe"]', 'roles = ["zoe", "careful"]')  # noqa: ASYNC240 - small
    rules.write_text(f'{text}[roles.careful]\nfrom = ["{origin}"]\ndeny.publish = ["/zoe/cmd"]\n')  # noqa: ASYNC240
    guarded.broker.reload()
    assert [await publishes(site, address) for address in ("127.0.0.1", "127.0.0.2")] == [here, there]


async def publishes(site: GuardedSite, address: str) -> bool:
    """Return whether Zoe may publish below /zoe with a browser at an address, whatever headers it sends."""
    document = {"type": "std_msgs/msg/String", "message": {"data": "hi"}}
    headers = {"Authorization": f"Bearer {ZOE}", "X-Forwarded-For": "127.0.0.1", "X-Real-IP": "127.0.0.1"}
    connector = aiohttp.TCPConnector(local_addr=(address, 0))
    async with (
        asyncio.timeout(DEADLINE_SEC),
        aiohttp.ClientSession(site.url, connector=connector, headers=headers) as client,
        client.post("/api/topics/zoe/cmd", json=document) as response,
    ):
        assert response.status in {200, 403}, await response.text()
        return response.status == 200


async def test_the_servers_own_token_has_the_rights_of_the_server_everywhere(
    rules: Path, site: GuardedSite, guarded: Meeting
) -> None:
    """Case 83: it is the page's own connection, which claims to be nobody else's."""
    text = rules.read_text().replace("[roles.full]", '[roles.full]\nfrom = ["127.0.0.1"]')  # noqa: ASYNC240
    rules.write_text(text)  # noqa: ASYNC240
    guarded.broker.reload()
    assert await status_from(site, "127.0.0.2", SERVER) == 200
    assert await names(site, SERVER) == {"/ours", "/zoe/driver"}


async def test_a_user_is_at_a_few_addresses_at_a_time(
    site: GuardedSite, guarded: Meeting, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Case 76: more would take the workspaces of others; those left a minute ago do not count."""
    assert limits.MAX_USERS >= 4 * limits.MAX_USER_ADDRESSES
    monkeypatch.setattr(limits, "MAX_USER_ADDRESSES", 2)
    monkeypatch.setattr(users, "IDLE_SEC", 3600.0)
    before = guarded.broker.stats().connections
    assert [await status_from(site, f"127.0.0.{n}", ZOE) for n in (2, 3, 4, 3)] == [200, 200, 503, 200]
    assert guarded.broker.stats().connections == before + 2
    assert await status_from(site, "127.0.0.4", OPERATOR) == 200
    monkeypatch.setattr(users, "IDLE_SEC", 0.0)
    assert await status_from(site, "127.0.0.2", ZOE) == 200
    await until(lambda: guarded.broker.stats().connections == before + 2)
    assert await status_from(site, "127.0.0.4", ZOE) == 200
