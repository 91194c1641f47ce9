"""The newest images of topics. Each is converted once, however many browsers request it."""

from __future__ import annotations

import asyncio
from dataclasses import dataclass
from functools import partial
from itertools import count
from typing import TYPE_CHECKING, Final

from actors.interfaces.errors import InvalidMessageError
from actors.web.image_files import MAX_BYTES, ImageError, ImageFile, image_file_of
from proto.aio.tasks import cancel_and_wait

if TYPE_CHECKING:
    from collections.abc import Callable

    from actors.web.topic_feed import Received, TopicFeeds, TopicReader
    from actors.web.worker import Worker

IMAGE_TYPES: Final = frozenset({"sensor_msgs/msg/CompressedImage", "sensor_msgs/msg/Image"})

IMAGE_PERIOD_SEC: Final = 0.1
"""The least time between two images of a topic."""

WAIT_SEC: Final = 10.0
"""How long a request waits for an image. After that it gets none, and may be repeated."""

LINGER_SEC: Final = 10.0
"""How long a topic stays subscribed after a request, so that the next request finds its newest message."""

OTHER_FIELDS_BYTES: Final = 64 * 1024
"""The size that a message may have besides the data of its image."""

_NUMBERS: Final = count(1)


@dataclass(frozen=True, kw_only=True, slots=True)
class Image:
    """An image, or why a message has none.

    Attributes:
        number: Different for each image of this process.
        sent_ns: When it was sent, in ns since the epoch.
        found: The file, or the error.
    """

    number: int
    sent_ns: int
    found: ImageFile | ImageError


class TopicImages:
    """The images of one topic.

    Args:
        reader: Returns a reader that keeps the newest message, and calls a function when there is one.
        converting, conversions: Held while an image is converted.
        unused: Called when nobody has asked for `LINGER_SEC`.

    Raises:
        InvalidTopicNameError, TooManyTopicsError: See `TopicFeeds.read`.
    """

    def __init__(
        self,
        reader: Callable[[Callable[[], None]], TopicReader],
        converting: asyncio.Lock,
        conversions: asyncio.Semaphore,
        unused: Callable[[], object],
    ) -> None:
        self._loop = asyncio.get_running_loop()
        self._news = asyncio.Event()
        self._reader = reader(self._news.set)
        self._converting, self._conversions = converting, conversions
        self._unused = unused
        self._newest: Image | None = None
        self._next: asyncio.Task[None] | None = None
        """Reads the next image; all requests for it wait for this one task."""
        self._next_at = 0.0
        self._timer = self._loop.call_later(LINGER_SEC, self._expire)

    async def newest(self, after: int) -> Image | None:
        """Return the newest image; see `Images.newest`."""
        if self._newest is None or self._newest.number == after or self._news.is_set():
            if self._next is None or self._next.done():
                self._next = self._loop.create_task(self._read())
            self._restart_timer()
            # Shielded: a browser that disconnects must not end the wait of the others.
            await asyncio.shield(self._next)
        self._restart_timer()
        newest = self._newest
        return newest if newest is not None and newest.number != after else None

    async def close(self) -> None:
        """Stop reading."""
        self._timer.cancel()
        if self._next is not None:
            await cancel_and_wait(self._next)
        self._reader.close()

    async def _read(self) -> None:
        """Convert the newest message, or wait for the first one."""
        await self._reader.accepted()
        await asyncio.sleep(self._next_at - self._loop.time())
        try:
            async with asyncio.timeout(WAIT_SEC):
                await self._news.wait()
        except TimeoutError:
            return
        async with self._converting, self._conversions:
            self._news.clear()
            (received,) = self._reader.pop()
            found = await self._converted(received)
        self._newest = Image(number=next(_NUMBERS), sent_ns=received.info.source_timestamp, found=found)
        self._next_at = self._loop.time() + IMAGE_PERIOD_SEC

    async def _converted(self, received: Received) -> ImageFile | ImageError:
        if len(received.data) > MAX_BYTES + OTHER_FIELDS_BYTES:
            return ImageError(f"The message has {len(received.data)} bytes; images to {MAX_BYTES} are shown")
        try:
            return await asyncio.to_thread(self._image_file_of, received.data)
        except InvalidMessageError as error:
            return ImageError(str(error))
        except ImageError as error:
            return error

    def _image_file_of(self, data: bytes) -> ImageFile:
        return image_file_of(self._reader.decode(data, MAX_BYTES + OTHER_FIELDS_BYTES))

    def _restart_timer(self) -> None:
        self._timer.cancel()
        self._timer = self._loop.call_later(LINGER_SEC, self._expire)

    def _expire(self) -> None:
        if self._next is not None and not self._next.done():
            self._restart_timer()
            return
        self._reader.close()
        self._unused()


class Images:
    """The topics whose images are asked for.

    Args:
        feeds: Read topics.
        worker: Limits the images that all users convert at the same time.
    """

    def __init__(self, feeds: TopicFeeds, worker: Worker) -> None:
        self._feeds, self._worker = feeds, worker
        self._topics: dict[str, TopicImages] = {}
        self._converting = asyncio.Lock()
        """Held while an image is converted: all topics of a user together keep one thread busy at most."""

    async def newest(self, topic: str, after: int) -> Image | None:
        """Return the newest image of a topic as soon as there is another one than the caller has.

        Args:
            topic: Its full name.
            after: The number of the image that the caller has; 0 for none.

        Returns:
            The image; None if no message arrives within `WAIT_SEC`.

        Raises:
            InvalidTopicNameError, TooManyTopicsError: See `TopicFeeds.read`.
            SubscriptionRefusedError: The broker refuses the subscription.
        """
        found = self._topics.get(topic)
        if found is None:
            read = partial(self._feeds.read, topic, 1)
            found = TopicImages(
                read, self._converting, self._worker.conversions, partial(self._topics.pop, topic)
            )
            self._topics[topic] = found
        return await found.newest(after)

    async def close(self) -> None:
        """Stop reading."""
        for each in self._topics.values():
            await each.close()
        self._topics.clear()
