"""The images of topics over HTTP."""

from __future__ import annotations

import asyncio
from contextlib import suppress
from random import Random
from typing import TYPE_CHECKING, Any

import pytest

import actors
from actors.interfaces.sensor_msgs.msg import CompressedImage, Image
from actors.interfaces.std_msgs.msg import String
from actors.web import images, limits
from tests.actors.meeting import DEADLINE_SEC, latched, until
from tests.actors.web.image_data import JPEG, read_png

if TYPE_CHECKING:
    from aiohttp import ClientResponse

    from tests.actors.meeting import Meeting
    from tests.actors.web.site import Site

PATH = "/api/topics/camera/image"


def pixels(value: int) -> Image:
    """Return an image of one gray pixel."""
    return Image(width=1, height=1, encoding="mono8", step=1, data=bytes([value]))


class Camera:
    """A topic, and requests for its images.

    Args:
        site: The web server.
        meeting: Has the broker.
    """

    def __init__(self, site: Site, meeting: Meeting) -> None:
        self._site = site
        self._meeting = meeting

    async def publisher(self, kind: Any = Image, *, keep: int = 0) -> Any:
        """Return a publisher that the server knows of; `keep` messages are kept for late joiners."""
        node = await self._meeting.node("camera")
        publisher = node.create_publisher(kind, "camera", latched(keep) if keep else 10)
        await self._site.json_found("/api/topics/camera")
        return publisher

    async def get(self, after: int | None = None, status: int = 200) -> tuple[ClientResponse, bytes]:
        """Ask for the image after one."""
        async with asyncio.timeout(DEADLINE_SEC):
            query = {} if after is None else {"after": after}
            async with self._site.client.get(PATH, params=query) as response:
                assert response.status == status, await response.text()
                return response, await response.read()


@pytest.fixture
def camera(site: Site, meeting: Meeting) -> Camera:
    """A topic with images."""
    return Camera(site, meeting)


def number_of(response: ClientResponse) -> int:
    """Return the number of an image."""
    return int(response.headers["Image-Number"])


async def test_the_newest_image_is_a_file_with_its_size(camera: Camera) -> None:
    """And a type that no browser may guess; nothing keeps it."""
    publisher = await camera.publisher(keep=2)
    for value in (1, 7):
        publisher.publish(pixels(value))
    response, body = await camera.get()
    while read_png(body)[1] != b"\0\7":
        response, body = await camera.get(number_of(response))
    headers = response.headers
    assert headers["Content-Type"] == "image/png"
    assert headers["X-Content-Type-Options"] == "nosniff"
    assert headers["Cache-Control"] == "no-store"
    assert (headers["Image-Size"], headers["Image-Encoding"]) == ("1x1", "mono8")
    assert int(headers["Image-Sent-Ns"]) > 0


async def test_a_jpeg_file_is_passed_on(camera: Camera) -> None:
    """Byte for byte."""
    (await camera.publisher(CompressedImage, keep=1)).publish(CompressedImage(format="png", data=JPEG))
    response, body = await camera.get()
    assert (response.headers["Content-Type"], body) == ("image/jpeg", JPEG)
    assert response.headers["Image-Size"] == "5x3"


async def test_the_next_image_is_awaited_and_none_is_missed_between_two_requests(camera: Camera) -> None:
    """The same one is never sent again to who names it; one that comes when nobody waits is kept."""
    publisher = await camera.publisher()
    waiting = asyncio.create_task(camera.get())
    await until(publisher.get_subscription_count)
    publisher.publish(pixels(1))
    response, _ = await waiting
    publisher.publish(pixels(2))
    response, body = await camera.get(number_of(response))
    assert read_png(body)[1] == b"\0\2"
    waiting = asyncio.create_task(camera.get(number_of(response)))
    publisher.publish(pixels(3))
    assert read_png((await waiting)[1])[1] == b"\0\3"


async def test_all_who_wait_get_the_same_image(camera: Camera) -> None:
    """It is converted once."""
    publisher = await camera.publisher()
    waiting = [asyncio.create_task(camera.get()) for _ in range(5)]
    await until(publisher.get_subscription_count)
    publisher.publish(pixels(1))
    numbers = {number_of(response) for response, _ in await asyncio.gather(*waiting)}
    assert len(numbers) == 1


async def test_a_caller_that_leaves_does_not_end_the_wait_of_others(camera: Camera, site: Site) -> None:
    """Its request is cancelled; theirs is answered."""
    publisher = await camera.publisher()
    first = asyncio.create_task(camera.get())
    await until(publisher.get_subscription_count)
    second = asyncio.create_task(camera.get())
    first.cancel()
    assert (await site.json("/healthz"))["status"] == "ok"
    publisher.publish(pixels(1))
    assert read_png((await second)[1])[1] == b"\0\1"


async def test_nobody_waits_for_ever(camera: Camera, monkeypatch: pytest.MonkeyPatch) -> None:
    """Who has the newest image gets no content if no other one comes."""
    (await camera.publisher(keep=1)).publish(pixels(1))
    response, _ = await camera.get()
    monkeypatch.setattr(images, "WAIT_SEC", 0.05)
    assert (await camera.get(number_of(response), status=204))[1] == b""


async def test_a_topic_is_left_when_nobody_asks_any_more(
    camera: Camera, monkeypatch: pytest.MonkeyPatch
) -> None:
    """And read again for the next request."""
    monkeypatch.setattr(images, "LINGER_SEC", 0.05)
    publisher = await camera.publisher(keep=1)
    publisher.publish(pixels(1))
    await camera.get()
    await until(lambda: not publisher.get_subscription_count())
    assert read_png((await camera.get())[1])[1] == b"\0\1"


async def test_who_does_not_read_an_image_is_disconnected(
    camera: Camera, site: Site, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It would keep its bytes in memory."""
    monkeypatch.setattr(limits, "UNREAD_SEC", 0.5)
    monkeypatch.setattr(limits, "MAX_STREAMS", 1)
    side = 4096  # what the kernel keeps for a connection is less
    data = Random(1).randbytes(side * side)
    publisher = await camera.publisher(keep=1)
    publisher.publish(Image(width=side, height=side, step=side, encoding="mono8", data=data))
    reader, writer = await asyncio.open_connection("127.0.0.1", site.server.port, limit=1024)
    writer.write(f"GET {PATH} HTTP/1.1\r\nHost: localhost\r\n\r\n".encode())
    async with asyncio.timeout(DEADLINE_SEC):
        assert b"200" in await reader.readline()
        status = 503  # while the image is being sent
        while status == 503:
            async with site.client.get(PATH) as response:
                status = response.status
        with suppress(ConnectionResetError):
            assert len(await reader.read(-1)) < len(data)
    writer.close()


async def test_a_message_without_an_image_says_why(camera: Camera) -> None:
    """With its number, so that the next one can be awaited."""
    publisher = await camera.publisher()
    waiting = asyncio.create_task(camera.get(status=422))
    await until(publisher.get_subscription_count)
    publisher.publish(Image(width=2**32 - 1, height=2**32 - 1, encoding="rgb8", step=1, data=b"x"))
    response, body = await waiting
    assert b"at most" in body
    assert response.headers["Content-Type"].startswith("application/json")
    waiting = asyncio.create_task(camera.get(number_of(response)))
    publisher.publish(pixels(1))
    assert (await waiting)[0].headers["Image-Encoding"] == "mono8"


async def test_a_message_that_is_too_large_is_not_even_decoded(
    camera: Camera, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its size is said."""
    monkeypatch.setattr(images, "MAX_BYTES", 0)
    monkeypatch.setattr(images, "OTHER_FIELDS_BYTES", 10)
    (await camera.publisher(keep=1)).publish(pixels(1))
    assert b"bytes" in (await camera.get(status=422))[1]


async def test_a_class_that_is_not_installed_here_is_known_by_its_fields(camera: Camera) -> None:
    """The graph has its name; its definition is another one."""
    publisher = await camera.publisher(OtherImage, keep=1)
    publisher.publish(OtherImage(width=1, height=1, encoding="mono8", step=1, data=b"\5"))
    assert read_png((await camera.get())[1])[1] == b"\0\5"


class OtherImage(actors.Message, type_name="sensor_msgs/msg/Image"):
    """Images of a later release, with one more field."""

    width: int = 0
    height: int = 0
    encoding: str = ""
    step: int = 0
    data: bytes = b""
    exposure: float = 0.0


@pytest.mark.parametrize(("kind", "text"), [(String, "has no images"), (None, "There is no topic")])
async def test_other_topics_are_refused(camera: Camera, site: Site, kind: Any, text: str) -> None:
    """Those of other types, and unknown ones."""
    if kind is not None:
        await camera.publisher(kind)
    error = await site.json(PATH, 404 if kind is None else 400)
    assert text in error["error"]


async def test_the_number_is_checked(camera: Camera, site: Site) -> None:
    """It is one."""
    await camera.publisher()
    assert "int" in (await site.json(PATH, 400, params={"after": "x"}))["error"]
