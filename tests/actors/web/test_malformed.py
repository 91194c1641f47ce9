"""Requests that are malformed in any part."""

from __future__ import annotations

import logging
from typing import TYPE_CHECKING, Final

import pytest

from actors.web.refusals import Refusal
from proto.limited_log import MAX_LINES

if TYPE_CHECKING:
    from tests.actors.meeting import Meeting
    from tests.actors.web.site import Site

HOSTS: Final = (
    b"[::1",
    b"]",
    b"a]b",
    b"[",
    b"localhost:x",
    b"localhost:99999999",
    b"localhost:-1",
    b"localhost:",
    b"\xff\xfe",
    b"a b",
    b"user@localhost",
    b"localhost/..",
    b"localhost?x",
    b"localhost#x",
    b"[::1]x",
    b"",
    b"::1",
    b"[fe80::1%25eth0]",
    b"xn--\xc3\xa9",
    b"\xe2\x84\xa6",
    b"a" * 3000,
    b"localhost,localhost",
    b"1.2.3.4.5:1",
    b"[v1.x]",
    b"localhost:\xd9\xa1",
)
TOKENS: Final = (b"\xff\xfe", b"\xc3\xa9", b"", b" ", b"x" * 3000, b"\xed\xa0\x80", b'"', b"a;b", b"=")
QUERIES: Final = (
    b"?after=x",
    b"?after=" + b"9" * 3000,
    b"?after=1e9999",
    b"?after=%ff",
    b"?after=\xff",
    b"?type=%00",
    b"?type=" + b"a/" * 1000,
    b"?level=none",
    b"?level=%ed%a0%80",
    b"?x=1&x=2",
    b"?node=[",
    b"?node=%5b*%00",
    b"?=",
    b"?text=" + b"%e2%84%a6" * 300,
    b"?&&&;;==",
    b"#?",
)
NAMES_IN_PATHS: Final = (
    b"%00",
    b"%ff",
    b"\xff",
    b"..",
    b"%2e%2e%2f%2e%2e",
    b"/" * 500,
    b"%2F" * 500,
    b"a" * 3000,
    b"%ed%a0%80",
    b"*",
    b"{x}",
    b"~",
    b"%",
    b"%zz",
    b"a%0d%0aX:1",
    b"\xe2\x84\xa6",
    b"_action",
    b"x/_action/send_goal",
    b"@",
)
HEADERS: Final = (
    b"Range: bytes=9999999999999-",
    b"Range: x",
    b"If-None-Match: \xff",
    b'If-None-Match: "',
    b"If-None-Match: W/",
    b"If-Modified-Since: \xff",
    b"Last-Event-ID: \xff",
    b"Origin: \xff",
    b"Origin: null",
    b"Origin: http://[",
    b"Sec-Fetch-Site: \xff",
    b"Accept-Encoding: \xff",
    b"Cookie: \xff",
    b"Cookie: ;;;=",
    b"Cookie: callboard-0=\xff",
    b'Cookie: a="\\',
    b"Authorization: Bearer",
    b"Authorization: \xff",
    b"Content-Type: \xff",
    b"Content-Type: ;;",
    b"Upgrade: websocket",
    b"Upgrade: \xff",
    b"Connection: upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Key: \xff",
    b"Connection: upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 13\r\nSec-WebSocket-Key: eA==",
    b"Connection: upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 99999999999999999999",
    b"Expect: \xff",
    b"Expect: 100-continue",
    b"Content-Length: 5x",
    b"Content-Length: -1",
    b"Transfer-Encoding: \xff",
    b"Transfer-Encoding: chunked, chunked",
    b"Content-Encoding: gzip",
    b"TE: \xff",
    b"X-Forwarded-For: \xff",
)
BODIES: Final = (
    b"",
    b"[",
    b"[]",
    b"null",
    b"1",
    b'"x"',
    b"{",
    b"{}",
    b'{"token":1}',
    b'{"token":"\xff"}',
    b'{"token":"\\ud800"}',
    b"\xff",
    b'{"token":' + b"[" * 8000,
    b'{"x":' * 1300,
    b"[" * 8000 + b"]" * 8000,
    b'{"token":"' + b"x" * 8000 + b'"}',
    b'{"token":"\\u00e9"}',
    b'{"token":null}',
    b'{"token":1e999}',
    b'{"token":"a","token":"b"}',
    b"1" * 8000,
    b"\0",
    b" " * 8000,
)
CONTROL_BODIES: Final = (
    *BODIES,
    b'{"request":' + b'{"a":' * 3000 + b"1" + b"}" * 3001,
    b'{"message":' + b'{"a":' * 3000 + b"1" + b"}" * 3001,
    b'{"goal":' + b'{"a":' * 3000 + b"1" + b"}" * 3001,
    b'{"parameters":[{"name":"x","value":' + b"[" * 900 + b"]" * 900 + b"}]}",
    b'{"parameters":[{"name":"\\ud800","value":1}]}',
    b'{"parameters":[{"name":"x","value":' + b"9" * 5000 + b"}]}",
    b'{"request":{"a":' + b"9" * 5000 + b"}}",
    b'{"request":{"a":1e400}}',
    b'{"timeout_sec":1e400}',
    b'{"timeout_sec":-1}',
    b'{"timeout_sec":"x"}',
    b'{"message":{"data":"\\ud800"},"type":"std_msgs/msg/String"}',
    b'{"message":{"data":"x"},"type":"../x"}',
    b'{"message":{},"type":"a/msg/\\u0000"}',
    b'{"transition":[]}',
)
GETS: Final = (
    "topics/{}",
    "services/{}",
    "actions/{}",
    "nodes/{}",
    "topics/{}/image",
    "topics/{}/form",
    "services/{}/form",
    "actions/{}/form",
    "actions/{}/goals",
    "nodes/{}/parameters",
    "nodes/{}/lifecycle",
    "{}",
)
POSTS: Final = (
    "POST /api/topics/x",
    "POST /api/services/add",
    "POST /api/actions/x",
    "PATCH /api/nodes/server/parameters",
    "POST /api/nodes/server/lifecycle",
    "DELETE /api/actions/x/goals/%ff",
    "POST /api/session",
)


def request(line: bytes, *headers: bytes, host: bytes = b"localhost", body: bytes = b"") -> bytes:
    """Return the bytes of a request."""
    if body:
        headers += (b"Content-Length: %d" % len(body),)
    lines = (line + b" HTTP/1.1", b"Host: " + host, b"Connection: close", *headers, b"", body)
    return b"\r\n".join(lines)


def requests() -> list[bytes]:
    """Return requests that are malformed in one part each."""
    get = b"GET /api/topics"
    found = [request(get, host=host) for host in HOSTS]
    found += [request(b"GET /healthz", host=host) for host in HOSTS]
    found += [request(b"GET /", host=host) for host in HOSTS]
    found += [request(get, b"Authorization: Bearer secret", host=host) for host in HOSTS]
    found += [request(b"POST /api/session", host=host, body=b'{"token":"secret"}') for host in HOSTS]
    found += [request(get, b"Authorization: Bearer " + token) for token in TOKENS]
    found += [
        request(get, b"Cookie: callboard-%d=%s" % (port, token)) for token in TOKENS for port in (80, 7412)
    ]
    for path in GETS:
        for name in NAMES_IN_PATHS:
            place = path.encode().replace(b"{}", name)
            found.append(request(b"GET /api/" + place, b"Authorization: Bearer secret"))
    found += [request(b"GET /" + name) for name in NAMES_IN_PATHS]
    found += [request(get + query) for query in QUERIES]
    found += [request(b"GET /api/topics/x/image" + query) for query in QUERIES]
    found += [
        request(b"GET /api/log" + query.replace(b"text", b"txt")) for query in QUERIES if b"level" in query
    ]
    lines = get, b"GET /", b"GET /api/live", b"PUT /api/x"
    found += [request(line, header) for header in HEADERS for line in lines]
    found += [request(b"POST /api/session", body=body) for body in BODIES]
    secret = b"Authorization: Bearer secret"
    found += [request(post.encode(), secret, body=body) for post in POSTS for body in CONTROL_BODIES]
    return found


async def test_malformed_requests_are_errors_of_the_client(
    control: Site, meeting: Meeting, caplog: pytest.LogCaptureFixture
) -> None:
    """Case 74: in Host, tokens, cookies, paths, queries, headers and bodies; the log has a limit."""
    await meeting.node("server")
    caplog.set_level(logging.DEBUG, "callboard.web")
    for sent in requests():
        line = await control.first_line(sent)
        # 503: there is no such service.
        assert line[9:10] in {b"1", b"2", b"3", b"4"} or line[9:12] == b"503", (line, sent[:300])
    lines = [each for each in caplog.records if each.name.startswith("callboard.web")]
    texts = [each.getMessage() for each in lines if Refusal.MALFORMED.words in each.getMessage()]
    assert 0 < sum(not text.startswith("…") for text in texts) <= MAX_LINES  # and a sum for each 10 s
    assert all(each.exc_info is None and "\n" not in each.getMessage() for each in lines)
    assert await control.json("/api/nodes")


@pytest.mark.parametrize(
    "host", ["localhost", "127.0.0.1:7412", "[::1]:7412", "localhost:", "10.0.0.7", "LOCALHOST:80"]
)
async def test_well_formed_hosts_are_served(control: Site, host: str) -> None:
    """Case 74: as browsers and programs send them."""
    line = await control.first_line(request(b"GET /api/topics", host=host.encode()))
    assert line.split()[1] == b"200"


@pytest.mark.parametrize(
    ("line", "status"),
    [(b"PUT /api/topics", b"405"), (b"GET /api/unknown", b"404"), (b"POST /index.html", b"405")],
)
async def test_requests_without_a_route_say_what_is_wrong(control: Site, line: bytes, status: bytes) -> None:
    """A path that is unknown is told from a method that its path has not."""
    answered = await control.first_line(request(line, b"Authorization: Bearer secret"))
    assert answered.split()[1] == status
