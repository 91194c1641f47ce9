"""Decodes batches: all messages in one call, or one by one if some are invalid."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from actors.interfaces.errors import InvalidMessageError
from proto.queues.batches import split_messages
from proto.untrusted_text import peer_text

if TYPE_CHECKING:
    from collections.abc import Sequence

    from actors.interfaces.codec import Codec
    from actors.logging.logger import Logger
    from proto.wire.frames import Batch, Replay


class Decoder:
    """The decoder of one subscription.

    Args:
        codec: The message class's; None returns each message as bytes.
        topic: The topic's name, for the log.
        log: The node's.

    Attributes:
        failed: Messages dropped because they were not valid.
    """

    __slots__ = ("_codec", "_log", "_topic", "failed")

    def __init__(self, codec: Codec[Any] | None, topic: str, log: Logger) -> None:
        self.failed = 0
        self._codec = codec
        self._topic = topic
        self._log = log

    def decode(self, batch: Batch | Replay) -> tuple[list[Any], Sequence[int]]:
        """Return the valid messages of a batch, and their numbers."""
        numbers = range(batch.first_sequence, batch.first_sequence + batch.length)
        codec = self._codec
        if codec is None:
            return [bytes(message) for message in split_messages(batch)], numbers
        try:
            return codec.decode_batch(batch.payload), numbers
        except InvalidMessageError:
            return self._decode_each(codec, batch)

    def _decode_each(self, codec: Codec[Any], batch: Batch | Replay) -> tuple[list[Any], Sequence[int]]:
        """Keep the valid messages of a batch."""
        valid: list[Any] = []
        numbers: list[int] = []
        for number, message in enumerate(split_messages(batch), batch.first_sequence):
            try:
                valid.append(codec.decode(message))
                numbers.append(number)
            except InvalidMessageError as error:
                self.failed += 1
                self._log.warning(
                    f"Dropped an invalid message on '{self._topic}': {peer_text(str(error))}",
                    throttle_duration_sec=1.0,
                )
        return valid, numbers
