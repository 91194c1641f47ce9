"""What waits to be sent on one link, and in which order it goes. Pure: whoever owns a socket pulls from it.

Control frames go first, then requests and replies, then the *lanes* in turn. A lane is one publisher's queue:
its depth bounds the messages in it, exactly, by dropping the oldest; its credit, where it has one, holds them
back. Large frames leave in fragments, one at each turn of their lane, so they hold up nobody.
"""

from __future__ import annotations

from collections import deque

from proto import limits
from proto.codec import encode
from proto.fragments import Transfer, is_large
from proto.frames import Abort, Buffer, Run
from proto.runs import cut, message_bytes, readdress


class Lane:
    """The unsent messages of one publisher on one link.

    Attributes:
        publisher: The id its runs carry on this link; runs queued under an earlier id are rewritten.
        depth: Messages kept when the link is busy; None keeps all.
        pending: Messages queued now.
        pending_bytes: Their size.
        dropped: Messages dropped so far, because the link was slower than the publisher.
        sent_bytes: Bytes of messages that have left on this link; what `byte_limit` is compared with.
        sequence_limit, byte_limit: Credit; None is unlimited.
    """

    __slots__ = (
        "_queue",
        "_skip",
        "_transfer",
        "byte_limit",
        "depth",
        "dropped",
        "pending",
        "pending_bytes",
        "publisher",
        "scheduled",
        "sent_bytes",
        "sequence_limit",
    )

    def __init__(self, publisher: int, depth: int | None) -> None:
        self.publisher = publisher
        self.depth = depth
        self.pending = 0
        self.pending_bytes = 0
        self.dropped = 0
        self.sent_bytes = 0
        self.sequence_limit: int | None = None
        self.byte_limit: int | None = None
        self.scheduled = False
        self._queue: deque[Run | bytes] = deque()
        self._skip = 0
        self._transfer: Transfer | None = None

    def put(self, item: Run | bytes) -> None:
        """Queue a run, or an encoded control frame that must stay behind the runs before it."""
        self._queue.append(item)
        if isinstance(item, Run):
            self.pending += item.length
            self.pending_bytes += message_bytes(item)

    def trim(self) -> list[bytes]:
        """Drop the oldest messages beyond the depth (and the byte ceiling, but never the last message).

        Returns:
            Control frames that stood before a dropped run and must go now.
        """
        freed: list[bytes] = []
        if self.depth is None:
            return freed
        while self.pending > self.depth or (self.pending_bytes > limits.LANE_BYTES and self.pending > 1):
            if self._transfer is not None and len(self._queue) == 1:
                break
            head = self._take_oldest()
            if not isinstance(head, Run):
                freed.append(head)
                continue
            left = head.length - self._skip
            excess = self.pending - self.depth if self.pending > self.depth else self.pending - 1
            gone = min(left, excess)
            self.pending -= gone
            self.dropped += gone
            if gone == left:
                self.pending_bytes -= message_bytes(head)
                self._skip = 0
            else:
                self._skip += gone
                self._put_oldest(head)
        return freed

    def _take_oldest(self) -> Run | bytes:
        """Remove the oldest item that has not begun to leave."""
        if self._transfer is None:
            return self._queue.popleft()
        leaving = self._queue.popleft()
        oldest = self._queue.popleft()
        self._queue.appendleft(leaving)
        return oldest

    def _put_oldest(self, item: Run) -> None:
        if self._transfer is None:
            self._queue.appendleft(item)
        else:
            self._queue.insert(1, item)

    @property
    def sendable(self) -> bool:
        """Whether the next item may go now: there is one, and credit allows it."""
        if not self._queue:
            return False
        head = self._queue[0]
        if self._transfer is not None or not isinstance(head, Run):
            return True
        if self.sequence_limit is not None and head.first_sequence + self._skip >= self.sequence_limit:
            return False
        return self.byte_limit is None or self.sent_bytes < self.byte_limit

    @property
    def empty(self) -> bool:
        """Whether everything put in has left."""
        return not self._queue

    def begin(self) -> Buffer:
        """Make the next item ready to leave and return its encoded frame. Needs `sendable`."""
        head = self._queue[0]
        if not isinstance(head, Run):
            return head
        stop = head.length
        if self.sequence_limit is not None:
            stop = min(stop, self.sequence_limit - head.first_sequence)
        run = readdress(cut(head, self._skip, stop), self.publisher)
        if stop < head.length or self._skip:
            rest = [cut(head, stop, head.length)] if stop < head.length else []
            self.pending_bytes -= message_bytes(head)
            self.pending_bytes += message_bytes(run) + sum(map(message_bytes, rest))
            self._queue.popleft()
            self._queue.extendleft([*rest, run])
            self._skip = 0
        elif run is not head:
            self._queue[0] = run
        return run.raw

    def finish(self) -> None:
        """Take out the item that `begin` returned: it has left whole."""
        head = self._queue.popleft()
        self._transfer = None
        if isinstance(head, Run):
            size = message_bytes(head)
            self.pending -= head.length
            self.pending_bytes -= size
            self.sent_bytes += size

    def restart(self, publisher: int) -> None:
        """Prepare for a new link: another publisher id, no credit yet, half-sent messages whole again."""
        self.publisher = publisher
        self.sent_bytes = 0
        self.sequence_limit = None
        self.byte_limit = None
        self.scheduled = False
        self._transfer = None

    def next_piece(self, transfers: Transfers) -> bytes | None:
        """Return the next frame to send, or None when no transfer may start now. Needs `sendable`."""
        if self._transfer is None:
            raw = self.begin()
            if not is_large(raw):
                self.finish()
                return bytes(raw)
            self._transfer = transfers.start(raw)
            if self._transfer is None:
                return None
        piece, last = self._transfer.next()
        if last:
            transfers.end(self._transfer)
            self.finish()
        return piece

    def discard(self, transfers: Transfers) -> bytes | None:
        """Drop everything; return the ABORT for a transfer that had begun."""
        transfer = self._transfer
        self._queue.clear()
        self._transfer = None
        self.pending = self.pending_bytes = self._skip = 0
        if transfer is None:
            return None
        transfers.end(transfer)
        return encode(Abort(transfer.id))


class Transfers:
    """The fragmented frames under way on one link: how many, and their ids."""

    __slots__ = ("_next_id", "_open")

    def __init__(self) -> None:
        self._next_id = 0
        self._open: set[int] = set()

    def start(self, raw: Buffer) -> Transfer | None:
        """Begin a transfer, unless as many as allowed are under way."""
        if len(self._open) >= limits.MAX_TRANSFERS:
            return None
        self._next_id = (self._next_id + 1) % limits.MAX_U32
        self._open.add(self._next_id)
        return Transfer(self._next_id, raw)

    def end(self, transfer: Transfer) -> None:
        """A transfer is over."""
        self._open.discard(transfer.id)


class Outbox:
    """Everything that waits on one link.

    The owner puts things in, then calls `next` until it gets None or its transport is full; when the
    transport is full it calls `trim`, so that only a busy link drops.
    """

    __slots__ = ("_calls", "_control", "_large_calls", "_ready", "_touched", "_transfers", "urgent_bytes")

    def __init__(self) -> None:
        self._control: deque[bytes] = deque()
        self._calls: deque[bytes] = deque()
        self._ready: deque[Lane] = deque()
        self._touched: list[Lane] = []
        self._large_calls: dict[tuple[int, int], tuple[Lane, int]] = {}
        self._transfers = Transfers()
        self.urgent_bytes = 0
        """Bytes of control frames and calls that wait: they are never dropped, so their owner caps them."""

    def put_control(self, raw: bytes) -> None:
        """Queue a frame that goes before everything else."""
        self._control.append(raw)
        self.urgent_bytes += len(raw)

    def put_calls(self, raw: bytes, key: tuple[int, int] = (0, 0)) -> None:
        """Queue a frame of requests, replies or cancellations.

        A large one takes its turn with the lanes; `key` (endpoint, call id) names it for `drop_call`.
        """
        self.urgent_bytes += len(raw)
        if not is_large(raw):
            self._calls.append(raw)
            return
        lane = Lane(0, None)
        lane.put(raw)
        self._large_calls[key] = lane, len(raw)
        self._schedule(lane)

    def drop_call(self, key: tuple[int, int]) -> bool:
        """Take a large call back; False if it is not there any more, because it has left whole."""
        if key not in self._large_calls:
            return False
        lane = self._forget_call(key)
        if lane.empty:
            return False
        abort = lane.discard(self._transfers)
        if abort is not None:
            self.put_control(abort)
        return True

    def put_lane(self, lane: Lane, item: Run | bytes) -> None:
        """Queue a run, or a control frame that must stay in order with it, in its lane."""
        lane.put(item)
        self._touched.append(lane)
        self._schedule(lane)

    def wake(self, lane: Lane) -> None:
        """Look at a lane again after its credit or its link has changed."""
        self._schedule(lane)

    def _schedule(self, lane: Lane) -> None:
        if not lane.scheduled and lane.sendable:
            lane.scheduled = True
            self._ready.append(lane)

    def next(self) -> bytes | None:
        """Return the next encoded frame to write, or None if nothing may go now."""
        for urgent in (self._control, self._calls):
            if urgent:
                raw = urgent.popleft()
                self.urgent_bytes -= len(raw)
                return raw
        for _ in range(len(self._ready)):
            lane = self._ready.popleft()
            lane.scheduled = False
            if not lane.sendable:
                continue
            piece = lane.next_piece(self._transfers)
            self._schedule(lane)
            if piece is not None:
                return piece
        for key in [key for key, (lane, _) in self._large_calls.items() if lane.empty]:
            self._forget_call(key)
        return None

    def _forget_call(self, key: tuple[int, int]) -> Lane:
        lane, size = self._large_calls.pop(key)
        self.urgent_bytes -= size
        return lane

    def trim(self) -> None:
        """Bring the lanes that were put to back to their depth: the link is busy."""
        for lane in self._touched:
            for raw in lane.trim():
                self.put_control(raw)
        self._touched.clear()

    def settle(self) -> None:
        """Forget which lanes were put to: everything that may go has gone."""
        self._touched.clear()
