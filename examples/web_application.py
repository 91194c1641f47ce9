"""A node inside a web application, as a plain ASGI app: `uvicorn web_application:app` in this folder.

Beside it run `callboard broker`, `minimal_publisher.py` and `add_two_ints_server.py`. The latest message is
at http://127.0.0.1:8000/latest, and http://127.0.0.1:8000/add?a=5&b=3 calls the service.
"""

import json
from collections.abc import Awaitable, Callable
from typing import Any
from urllib.parse import parse_qsl

import callboard
from actors.interfaces.example_interfaces.srv import AddTwoInts
from actors.interfaces.std_msgs.msg import String

Receive = Callable[[], Awaitable[dict[str, Any]]]
Send = Callable[[dict[str, Any]], Awaitable[None]]


class Gateway(callboard.Node):
    def __init__(self) -> None:
        super().__init__("web_gateway")
        self.latest = ""
        self.create_subscription(String, "addison", self.on_message, 10)
        self.adder = self.create_client(AddTwoInts, "add_two_ints")

    def on_message(self, msg: String) -> None:
        self.latest = msg.data

    async def answer(self, path: str, query: dict[str, str]) -> tuple[int, dict[str, Any]]:
        if path == "/latest":
            return 200, {"latest": self.latest}
        try:
            request = AddTwoInts.Request(a=int(query["a"]), b=int(query["b"]))
            response = await self.adder.call(request, timeout_sec=5)
        except (KeyError, ValueError):
            return 400, {"error": "a and b must be integers"}
        except callboard.CallFailed as error:
            return 503, {"error": str(error)}
        return 200, {"sum": response.sum}


gateway = Gateway()


async def app(scope: dict[str, Any], receive: Receive, send: Send) -> None:
    if scope["type"] == "lifespan":  # the node lives as long as the server
        await receive()
        async with gateway:
            await send({"type": "lifespan.startup.complete"})
            await receive()
        await send({"type": "lifespan.shutdown.complete"})
    elif scope["type"] == "http":
        status, body = await gateway.answer(scope["path"], dict(parse_qsl(scope["query_string"].decode())))
        headers = [(b"content-type", b"application/json")]
        await send({"type": "http.response.start", "status": status, "headers": headers})
        await send({"type": "http.response.body", "body": json.dumps(body).encode()})
