"""The page and the API over HTTP, against a broker."""

from __future__ import annotations

import asyncio
import ssl
from contextlib import AsyncExitStack
from typing import TYPE_CHECKING

import aiohttp
import pytest

from actors.interfaces.std_msgs.msg import String
from actors.web import security
from actors.web.options import WebOptions
from actors.web.server import WebListenError
from actors.web.token_file import TokenFileError, read_token
from proto.aio.tls import server_context
from tests.actors.meeting import DEADLINE_SEC, latched
from tests.actors.web.site import Site
from tests.certificates import Authority

if TYPE_CHECKING:
    from pathlib import Path

    from tests.actors.meeting import Meeting


async def test_the_page_is_there_compressed_and_cached(site: Site) -> None:
    """A browser that has it asks whether it is still the same, and gets no content."""
    async with site.client.get("/") as response:
        assert response.status == 200
        assert response.content_type == "text/html"
        assert response.headers["Content-Encoding"] == "gzip"
        assert "<title>callboard</title>" in await response.text()
        tag = response.headers["ETag"]
    async with site.client.get("/", headers={"If-None-Match": tag}) as response:
        assert response.status == 304


@pytest.mark.parametrize("path", ["/", "/js/main.js", "/nothing", "/api/topics", "/api/nothing"])
async def test_every_answer_has_the_headers_that_protect_the_page(site: Site, path: str) -> None:
    """Errors included."""
    async with site.client.get(path) as response:
        assert {name: response.headers.get(name) for name in security.HEADERS} == security.HEADERS


@pytest.mark.parametrize("path", ["/nothing", "/api/nothing", "/js/../server.py", "/..%2fserver.py"])
async def test_what_does_not_exist_is_404(site: Site, path: str) -> None:
    """Also what exists beside the page's files."""
    assert "error" in await site.json(path, 404)


async def test_the_graph_is_what_the_command_line_prints(site: Site, meeting: Meeting) -> None:
    """Topics, services, nodes, and one of each by its name, with or without its first slash."""
    node = await meeting.node("talker")
    node.create_publisher(String, "chatter", 3)
    topics = await site.json_until(
        "/api/topics", lambda found: "/chatter" in [each["name"] for each in found]
    )
    assert {
        "name": "/chatter",
        "types": ["std_msgs/msg/String"],
        "publisher_count": 1,
        "subscription_count": 0,
    } in topics
    assert await site.json("/api/nodes") == [{"name": "/talker"}]
    topic = await site.json("/api/topics/chatter")
    assert topic == await site.json("/api/topics/%2Fchatter")
    assert [each["qos"]["depth"] for each in topic["publishers"]] == [3]
    node_document = await site.json("/api/nodes/talker")
    assert {"name": "/chatter", "types": ["std_msgs/msg/String"]} in node_document["publishers"]
    assert {"source": "/talker", "target": "/chatter", "relation": "publishes"} in (
        await site.json("/api/graph")
    )["edges"]


@pytest.mark.parametrize("area", ["topics", "services", "actions", "nodes"])
async def test_an_unknown_name_is_404(site: Site, area: str) -> None:
    """The error names it."""
    assert "/nowhere" in (await site.json(f"/api/{area}/nowhere", 404))["error"]


async def test_the_server_itself_is_not_in_the_graph(site: Site, meeting: Meeting) -> None:
    """Its node is hidden, and what it subscribes to is not counted."""
    node = await meeting.node("talker")
    publisher = node.create_publisher(String, "chatter", latched(1))
    publisher.publish(String(data="hello"))
    async with site.client.get("/api/topics/chatter/echo") as response:
        async with asyncio.timeout(DEADLINE_SEC):
            assert b"event: message" in await response.content.readuntil(b"\n")
        topic = await site.json("/api/topics/chatter")
    assert topic["subscriptions"] == []


async def test_two_readers_of_a_latched_topic_both_get_its_message(site: Site, meeting: Meeting) -> None:
    """They share one subscription, which had its message when the second came."""
    node = await meeting.node("talker")
    publisher = node.create_publisher(String, "chatter", latched(1))
    publisher.publish(String(data="hello"))
    await site.json_until("/api/topics", lambda found: "/chatter" in [each["name"] for each in found])
    async with AsyncExitStack() as stack, asyncio.timeout(DEADLINE_SEC):
        for _ in range(2):
            response = await stack.enter_async_context(site.client.get("/api/topics/chatter/echo"))
            assert b'"data":"hello"' in await response.content.readuntil(b"\n\n")
        assert publisher.get_subscription_count() == 1


async def test_the_last_reader_ends_the_subscription(site: Site, meeting: Meeting) -> None:
    """Nothing is received that nobody reads."""
    node = await meeting.node("talker")
    publisher = node.create_publisher(String, "chatter", 1)
    async with site.client.get("/api/topics/chatter/echo"):
        async with asyncio.timeout(DEADLINE_SEC):
            while not publisher.get_subscription_count():
                await node.get_graph()
    async with asyncio.timeout(DEADLINE_SEC):
        while publisher.get_subscription_count():
            publisher.publish(String(data="on"))
            await node.get_graph()


async def test_a_page_of_another_site_gets_nothing(site: Site) -> None:
    """Neither by its origin nor by a name that leads here."""
    assert "error" in await site.json("/api/topics", 403, headers={"Origin": "http://evil.example"})
    assert "error" in await site.json("/api/topics", 421, headers={"Host": "evil.example"})
    with pytest.raises(aiohttp.WSServerHandshakeError):
        await site.client.ws_connect("/api/live", headers={"Origin": "http://evil.example"})


async def test_names_of_the_server_may_be_written_in_any_case(meeting: Meeting) -> None:
    """A browser sends them in lower case."""
    async with AsyncExitStack() as stack:
        site = await Site(stack, meeting, WebOptions(port=0, allowed_hosts=("Robot.Local",))).open()
        await site.json("/api/topics", headers={"Host": "robot.local:7412"})


async def test_beyond_loopback_reading_needs_the_token(meeting: Meeting) -> None:
    """In a header, or in the cookie that the page has set; the page itself needs none."""
    async with AsyncExitStack() as stack:
        site = Site(stack, meeting, WebOptions(host="0.0.0.0", port=0))
        await site.open()
        path = f"http://127.0.0.1:{site.server.port}"
        token = site.server.token
        assert site.server.url_with_token.endswith(f"/#token={token}")
        assert "token" in (await site.json(f"{path}/api/topics", 401))["error"]
        await site.json(f"{path}/api/topics", headers={"Authorization": f"Bearer {token}"})
        await site.json(f"{path}/api/topics", headers={"Cookie": f"callboard-{site.server.port}={token}"})
        async with site.client.get(path) as response:
            assert response.status == 200


async def test_a_port_that_is_taken_is_one_clear_error(site: Site, meeting: Meeting) -> None:
    """It names the address."""
    async with AsyncExitStack() as stack:
        with pytest.raises(WebListenError, match=f"127.0.0.1:{site.server.port}"):
            await Site(stack, meeting, WebOptions(port=site.server.port)).open()


async def test_a_name_that_cannot_be_one_is_one_clear_error(meeting: Meeting) -> None:
    """It never reaches the resolver."""
    async with AsyncExitStack() as stack:
        with pytest.raises(WebListenError, match=r"robot\.\.local:0"):
            await Site(stack, meeting, WebOptions(host="robot..local", port=0)).open()


async def test_without_a_broker_the_api_says_so(site: Site, meeting: Meeting) -> None:
    """503, while the page goes on to be served."""
    await meeting.stop_broker()
    assert "error" in await site.json("/api/overview", 503)
    async with site.client.get("/") as response:
        assert response.status == 200


async def test_a_browser_signs_in_for_a_cookie_that_reads_and_does_not_control(meeting: Meeting) -> None:
    """The cookie is out of reach of scripts and other sites; controls need the header."""
    async with AsyncExitStack() as stack:
        options = WebOptions(host="0.0.0.0", port=0, token="secret", allow_control=True)
        site = await Site(stack, meeting, options).open()
        jar = aiohttp.CookieJar(unsafe=True)
        site.client = await stack.enter_async_context(aiohttp.ClientSession(site.url, cookie_jar=jar))
        await site.json("/api/topics", 401)
        await site.json("/api/session", 401, "POST", json={"token": "guessed"})
        await site.json("/api/topics", 401)
        async with site.client.post("/api/session", json={"token": "secret"}) as response:
            assert response.status == 200
            (cookie,) = response.cookies.values()
            assert (cookie["httponly"], cookie["samesite"]) == (True, "Strict")
        await site.json("/api/topics")
        async with site.client.ws_connect("/api/live"):
            pass
        assert "token" in (await site.json("/api/services/x", 401, "POST", json={}))["error"]


async def test_another_site_cannot_sign_a_browser_in(site: Site) -> None:
    """Not with the right token either."""
    body = {"token": site.server.token}
    await site.json("/api/session", 403, "POST", json=body, headers={"Origin": "http://evil.example"})


async def test_the_page_is_served_with_tls(meeting: Meeting, tmp_path: Path) -> None:
    """Its address says so, and the cookie never travels without it."""
    authority = Authority(tmp_path)
    pair = authority.issue("127.0.0.1")
    trusted = ssl.create_default_context(cafile=authority.ca)
    async with AsyncExitStack() as stack:
        options = WebOptions(port=0, tls=server_context(pair.certificate, pair.key, None))
        site = await Site(stack, meeting, options).open()
        assert site.url.startswith("https://")
        async with site.client.get("/healthz", ssl=trusted) as response:
            assert response.status == 200
        body = {"token": site.server.token}
        async with site.client.post("/api/session", json=body, ssl=trusted) as response:
            (cookie,) = response.cookies.values()
            assert cookie["secure"] is True


@pytest.mark.parametrize("content", ["", "short", "long enough but with blanks", b"\xff" * 20])
def test_a_file_without_a_usable_token_is_refused(content: str | bytes, tmp_path: Path) -> None:
    """The error names the file."""
    path = tmp_path / "token"
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    with pytest.raises(TokenFileError, match=str(path)):
        read_token(path)
    path.write_text("0123456789abcdef\n")
    assert read_token(path) == "0123456789abcdef"


async def test_localhost_is_this_machine(meeting: Meeting) -> None:
    """Reading needs no token there, as with its address."""
    async with AsyncExitStack() as stack:
        site = await Site(stack, meeting, WebOptions(host="localhost", port=0)).open()
        assert "#" not in site.server.url_with_token
        assert await site.json("/api/nodes") == []
