"""JSON that browsers and programs send."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import msgspec
import pytest

from actors.web.json_decoding import decode_json

if TYPE_CHECKING:
    from tests.actors.web.site import Site

DEEP = b'{"request":' + b"[" * 5000 + b"]" * 5000 + b"}"
BAD = {"key": b'{"\x89":1}', "value": b'{"a":"\xff"}', "deep": DEEP, "syntax": b"{", "list": b"[]"}


@pytest.mark.parametrize("data", BAD.values(), ids=BAD.keys())
def test_what_is_no_object_raises_one_error(data: bytes) -> None:
    """Case 74: also what msgspec answers with another error than its own."""
    with pytest.raises(msgspec.DecodeError):
        decode_json(data, dict[str, Any])


def test_what_is_an_object_is_decoded() -> None:
    """From bytes and from a string."""
    assert decode_json(b'{"a": [1, null]}', dict[str, Any]) == {"a": [1, None]}
    assert decode_json('{"a": "\\u00e4"}', dict[str, Any]) == {"a": "ä"}


async def test_a_deep_request_of_a_page_is_refused(site: Site) -> None:
    """Case 74: the page gets an error, and its WebSocket goes on."""
    async with site.client.ws_connect("/api/live") as socket:
        for text in (DEEP.decode(), json.dumps({"open": 1, "panel": "overview"})):
            await socket.send_str(text)
        assert (await socket.receive_json())["error"].endswith("it is nested too deeply")
        assert (await socket.receive_json())["id"] == 1
