"""Decodes batches: all messages in one call, or one by one if some are invalid.

What messages may leave out (`interfaces/decode_budget.py`) is limited for all that wait together, and in
time: otherwise a full queue would hold the allowance of one message a thousand times, and the messages of one
loop turn could use it as often.
"""

from __future__ import annotations

import time
from itertools import compress
from typing import TYPE_CHECKING, Any, ClassVar, Final

from actors.interfaces.decode_budget import LEAST_SPARE_BYTES, MAX_STEPS, SPARE_BYTES, Allowance
from actors.interfaces.errors import InvalidMessageError
from proto.queues.batches import split_messages
from proto.untrusted_text import peer_text

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from actors.interfaces.codec import Codec
    from actors.logging.logger import Logger
    from proto.wire.frames import Batch, Replay


RENEWAL_SEC: Final = 0.05
"""Time between two renewals of an allowance, which takes half of it to be used up."""

INVALID_STEPS: Final = 10
"""Steps of the allowance for a message that is dropped: its error takes longer than decoding it."""


class Decoder:
    """The decoder of one subscription.

    Args:
        codec: The message class's; None returns each message as bytes.
        topic: The topic's name, for the log.
        log: The node's.
        clock: Returns seconds.

    Attributes:
        failed: Messages dropped because they were not valid, or would have taken too much memory.
        selects: Whether it leaves out valid messages, as a `SelectingDecoder` does.
    """

    selects: ClassVar = False
    __slots__ = (
        "_allowance", "_clock", "_codec", "_default_bytes", "_excess", "_log", "_most", "_renewed", "_topic",
        "failed",
    )  # fmt: skip

    def __init__(
        self,
        codec: Codec[Any] | None,
        topic: str,
        log: Logger,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self.failed = 0
        self._codec = codec
        self._topic = topic
        self._log = log
        self._allowance = Allowance()
        self._clock = clock
        self._renewed = 0.0
        # Values of the budget, for the bound that each batch is compared with.
        budget = None if codec is None else codec.budget
        self._default_bytes = 0 if budget is None else budget.default_bytes
        self._excess = 0 if budget is None else budget.excess
        self._most = 0 if budget is None else budget.most

    def decode(self, batch: Batch | Replay, *, idle: bool = True) -> tuple[list[Any], Sequence[int]]:
        """Return the valid messages of a batch, and their numbers.

        Args:
            batch: The batch.
            idle: Whether no message decoded before still waits.
        """
        count, payload = batch.length, batch.payload
        numbers = range(batch.first_sequence, batch.first_sequence + count)
        codec = self._codec
        if codec is None:
            return [bytes(message) for message in split_messages(batch)], numbers
        size = len(payload)
        # As in `DecodeBudget.admits`, whose call would cost more than all of this: most batches can take
        # nothing of the allowance.
        needed = count * self._default_bytes + size * self._excess
        try:
            if size <= self._most:
                if needed <= 0:
                    return codec.decode_admitted(payload), numbers
                allowance = self._allowance
                if needed > allowance.memory:
                    self._renew(idle=idle)
                if needed <= allowance.memory:
                    allowance.memory -= needed
                    return codec.decode_admitted(payload), numbers
            return codec.decode_batch(payload, count, self._allowance), numbers
        except InvalidMessageError:
            return self._decode_each(codec, batch)

    def _renew(self, *, idle: bool) -> None:
        """Renew the allowance, if it is time to."""
        allowance, now = self._allowance, self._clock()
        if now < self._renewed + RENEWAL_SEC:
            return
        self._renewed = now
        allowance.steps = MAX_STEPS
        # While messages wait, they hold what they have used.
        if idle:
            allowance.memory = SPARE_BYTES

    def _decode_each(self, codec: Codec[Any], batch: Batch | Replay) -> tuple[list[Any], Sequence[int]]:
        """Keep the valid messages of a batch."""
        valid: list[Any] = []
        numbers: list[int] = []
        allowance = self._allowance
        self._renew(idle=False)
        # A busy consumer, too, gets messages that are small even with all defaults: the depth limits these.
        small = batch.length * max(codec.budget.default_bytes, LEAST_SPARE_BYTES)
        allowance.memory = max(allowance.memory, min(small, SPARE_BYTES))
        for number, message in enumerate(split_messages(batch), batch.first_sequence):
            if allowance.steps <= 0:
                self._drop(batch.first_sequence + batch.length - number, "too many invalid ones before it")
                break
            try:
                valid.append(codec.decode(message, allowance))
                numbers.append(number)
            except InvalidMessageError as error:
                allowance.steps -= INVALID_STEPS
                self._drop(1, peer_text(str(error)))
        return valid, numbers

    def _drop(self, count: int, reason: str) -> None:
        self.failed += count
        self._log.warning(
            f"Dropped an invalid message on '{self._topic}': {reason}", throttle_duration_sec=1.0
        )


class SelectingDecoder:
    """Leaves out messages that are not wanted, before they are queued: the depth is for those that are.

    Args:
        decoder: The subscription's own.
        wants: Gets each valid message as it was decoded, and returns whether it is received.

    Attributes:
        decoder: The subscription's own.
    """

    selects: ClassVar = True

    def __init__(self, decoder: Decoder, wants: Callable[[Any], bool]) -> None:
        self.decoder = decoder
        self._wants = wants

    @property
    def failed(self) -> int:
        """Messages dropped because they were not valid."""
        return self.decoder.failed

    def decode(self, batch: Batch | Replay, *, idle: bool = True) -> tuple[list[Any], Sequence[int]]:
        """Return the messages of a batch that are valid and wanted, and their numbers."""
        messages, numbers = self.decoder.decode(batch, idle=idle)
        wanted = [self._wants(message) for message in messages]
        return list(compress(messages, wanted)), list(compress(numbers, wanted))
