"""examples/web_application.py, driven like an ASGI server drives it."""

from __future__ import annotations

import asyncio
import json
import re
import runpy
from typing import TYPE_CHECKING, Any

import actors
from actors.interfaces.example_interfaces.srv import AddTwoInts
from actors.interfaces.std_msgs.msg import String
from tests.integration.conftest import DEADLINE_SEC, ROOT

if TYPE_CHECKING:
    import pytest

    import broker

EXAMPLE = ROOT / "examples" / "web_application.py"


async def get(app: Any, path: str, query: bytes = b"") -> tuple[int, dict[str, Any]]:
    """Return the status and the document of a response."""
    sent: list[dict[str, Any]] = []

    async def send(event: dict[str, Any]) -> None:
        sent.append(event)

    await app({"type": "http", "path": path, "query_string": query}, None, send)
    return sent[0]["status"], json.loads(sent[1]["body"])


async def test_handlers_read_topics_and_call_services(
    hub: broker.Broker, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The node runs as long as the application; a missing server and bad input are reported."""
    monkeypatch.setenv("CALLBOARD_URL", hub.url)
    app = runpy.run_path(str(EXAMPLE))["app"]
    orders: asyncio.Queue[dict[str, Any]] = asyncio.Queue()
    states: asyncio.Queue[dict[str, Any]] = asyncio.Queue()
    lifespan = asyncio.create_task(app({"type": "lifespan"}, orders.get, states.put))
    async with actors.Node("rest_of_the_system") as node, asyncio.timeout(DEADLINE_SEC):
        orders.put_nowait({"type": "lifespan.startup"})
        assert await states.get() == {"type": "lifespan.startup.complete"}
        assert await node.wait_for_node("web_gateway")

        assert (await get(app, "/add", b"a=5&b=3"))[0] == 503
        node.create_service(
            AddTwoInts, "add_two_ints", lambda request: AddTwoInts.Response(sum=request.a + request.b)
        )
        await node.create_client(AddTwoInts, "add_two_ints").wait_for_service()
        assert await get(app, "/add", b"a=5&b=3") == (200, {"sum": 8})
        assert await get(app, "/add", b"a=five") == (400, {"error": "a and b must be integers"})

        received = node.create_subscription(String, "addison", qos_profile=10)
        publisher = node.create_publisher(String, "addison", 10)
        publisher.publish(String(data="hello"))
        async for _ in received:
            break
        while (await get(app, "/latest"))[1] != {"latest": "hello"}:
            await asyncio.sleep(0)

        orders.put_nowait({"type": "lifespan.shutdown"})
        assert await states.get() == {"type": "lifespan.shutdown.complete"}
        await lifespan


def test_the_guide_shows_the_example() -> None:
    """Each snippet of docs/how-to/web.md is a part of the example."""
    guide = (ROOT / "docs" / "how-to" / "web.md").read_text(encoding="utf-8")
    snippets = re.findall(r"```python\n(.*?)```", guide, re.DOTALL)
    assert len(snippets) == 2
    for snippet in snippets:
        assert snippet in EXAMPLE.read_text(encoding="utf-8")
