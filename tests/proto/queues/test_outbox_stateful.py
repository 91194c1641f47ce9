"""The outbox against a model, with puts, pulls, trims, grants and restarts in any order."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import msgpack
import pytest
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, invariant, precondition, rule

from proto import limits
from proto.queues.batches import split_messages
from proto.queues.outbox import Outbox
from proto.queues.publisher_queue import PublisherQueue
from proto.wire.codec import decode, encode
from proto.wire.codes import Op
from proto.wire.fragments import Reassembler, is_large
from proto.wire.frames import Abort, Batch, Detached, Fragment, Ping, Replay, Undeclare
from tests.proto.outboxes import make_batch, request, take_one
from tests.seams.protocol import waiting_items
from tests.seams.structure import memory, of_queue

SIZES = st.lists(st.one_of(st.integers(1, 20), st.integers(100, 250)), min_size=1, max_size=5)
"""Sizes of the messages of a batch."""


@dataclass(frozen=True)
class Message:
    """A message of the model."""

    sequence: int
    body: bytes


def _replayed(item: Message | bytes) -> Replay | None:
    frame = None if isinstance(item, Message) else decode(item)
    return frame if isinstance(frame, Replay) else None


def _size(item: Message | bytes) -> int:
    if isinstance(item, Message):
        return 0
    replay = _replayed(item)
    return memory([item if replay is None else replay.payload])


@dataclass
class ModelQueue:
    """The expected content of a queue: messages, and encoded frames in order with them."""

    index: int
    queue: PublisherQueue
    waiting: list[Message | bytes] = field(default_factory=list)
    leaving: list[Message | bytes] = field(default_factory=list)
    next_put: int = 0
    next_sent: int = 0
    put: int = 0
    dropped: int = 0
    abandoned: int = 0
    sent_bytes: int = 0
    left_to: int = 0
    """The number after the last message that has come whole on any link."""
    resend_below: int = 0
    """Those below have left, or were dropped, on earlier links: losing them again is no loss."""

    def make(self, first: int, sizes: list[int]) -> tuple[Batch, list[Message | bytes]]:
        """Return a batch to put, and its messages."""
        parts = [bytes([(first + index) % 251]) * size for index, size in enumerate(sizes)]
        self.put += len(parts)
        new: list[Message | bytes] = [Message(first + index, part) for index, part in enumerate(parts)]
        return make_batch(first, parts, publisher=self.index), new

    @property
    def messages(self) -> list[Message]:
        """The messages that wait."""
        return [item for item in self.waiting if isinstance(item, Message)]

    @property
    def ordered_bytes(self) -> int:
        """Bytes of the frames that wait in order with the messages."""
        return sum(map(_size, (*self.waiting, *self.leaving)))

    @property
    def replay_bytes(self) -> int:
        """The part of them that are latched messages."""
        return sum(_size(item) for item in (*self.waiting, *self.leaving) if _replayed(item))

    def trim(self) -> None:
        """Drop the oldest messages beyond the depth."""
        if self.queue.depth is not None:
            excess = max(0, len(self.messages) - self.queue.depth)
            gone = self.messages[:excess]
            self.waiting = [item for item in self.waiting if item not in gone]
            again = sum(message.sequence < self.resend_below for message in gone)
            self.abandoned += again
            self.dropped += excess - again

    def restart(self, publisher: int) -> None:
        """Begin on another link, without what waited to be sent again."""
        waiting = [item for item in (*self.leaving, *self.waiting) if isinstance(item, Message)]
        self.leaving = []
        self.queue.restart(publisher)
        self.resend_below = self.queue.resend_below
        assert self.resend_below >= self.left_to
        new = [item for item in waiting if item.sequence >= self.resend_below]
        self.abandoned += len(waiting) - len(new)
        self.waiting = [*new]
        assert self.queue.first_sequence == (new[0].sequence if new else None)
        self.sent_bytes = 0
        self.next_sent = new[0].sequence if new else self.next_put

    def trim_queue(self) -> None:
        """The same, while there is no link."""
        self.queue.trim()
        self.trim()

    def drop_larger(self, most: int) -> None:
        """Drop the larger batches. Only the queue knows how it has split a partly sent one."""
        gone: set[int] = set()
        for batch in waiting_items(self.queue):
            if isinstance(batch, Batch):
                numbers = range(batch.first_sequence, batch.first_sequence + batch.length)
                left = {message.sequence: len(message.body) for message in self.messages}
                sizes = {number: left[number] for number in numbers if number in left}
                if sum(sizes.values()) > most:
                    gone |= sizes.keys()
        assert self.queue.drop_larger(most) == len(gone)
        self.waiting = [
            item for item in self.waiting if not (isinstance(item, Message) and item.sequence in gone)
        ]
        self.dropped += len(gone)

    def put_front(self, sizes: list[int]) -> None:
        """Put messages that have been sent before in front of what waits, under their old numbers."""
        first = self.messages[0].sequence if self.messages else self.next_put
        sizes = sizes[:first]
        if not sizes:
            return
        batch, again = self.make(first - len(sizes), sizes)
        self.queue.put_front(batch)
        self.waiting = [*again, *self.waiting]
        self.next_sent = min(self.next_sent, batch.first_sequence)

    def leave(self, count: int) -> None:
        """Messages have begun to leave: credit must allow each of them."""
        self.leaving, self.waiting = self.waiting[:count], self.waiting[count:]
        before, sent = self.next_sent, self.sent_bytes
        for message in self.leaving:
            assert isinstance(message, Message)
            limit = self.queue.sequence_limit
            assert limit is None or before < limit
            assert self.queue.byte_limit is None or sent < self.queue.byte_limit
            before = message.sequence + 1
            sent += len(message.body)

    def arrive(self, batch: Batch) -> None:
        """Check that a received batch has the messages being sent, in order and once."""
        assert batch.publisher == self.queue.publisher
        got = [
            Message(batch.first_sequence + index, bytes(body))
            for index, body in enumerate(split_messages(batch))
        ]
        assert got == self.leaving
        self.sent_bytes += sum(len(message.body) for message in got)
        self.next_sent = got[-1].sequence + 1
        self.left_to = max(self.left_to, self.next_sent)
        self.leaving = []


class OutboxMachine(RuleBasedStateMachine):
    """Puts, pulls, trims, grants and restarts in any order; every frame pulled is checked as a peer would."""

    def __init__(self) -> None:
        super().__init__()
        self.patch = pytest.MonkeyPatch()
        self.patch.setattr(limits, "MAX_FRAME_BYTES", 150)
        self.patch.setattr(limits, "FRAGMENT_BYTES", 100)
        self.patch.setattr(limits, "MAX_TRANSFERS", 2)
        self.links = 0
        self.models = [
            ModelQueue(index, PublisherQueue(index, depth)) for index, depth in enumerate((1, 3, None))
        ]
        self.next_token = 0
        self.connect()

    def connect(self) -> None:
        """Begin a link with nothing under way."""
        self.outbox = Outbox()
        self.reassembler = Reassembler()
        self.control: list[bytes] = []
        self.calls: list[bytes] = []
        self.large: dict[int, tuple[int, bytes]] = {}
        """By call: its endpoint, and the frame."""
        self.endpoint = 1
        """Which one makes calls now; the ids before it have said their last word."""
        self.behind: dict[int, bytes] = {}
        """Last words that wait for large calls."""
        self.transfers: dict[int, tuple[int, Any]] = {}
        """By id: the opcode, and the call or the index of the queue in `models`."""
        self.counted: set[int] = set()
        """The queues that got batches on this link."""

    def teardown(self) -> None:
        """Lift all credit and take everything: nothing is left and the counts are even."""
        try:
            self.finish()
        finally:
            self.patch.undo()

    def finish(self) -> None:
        """Take everything that is left."""
        for model in self.models:
            model.queue.sequence_limit = model.queue.byte_limit = None
            self.outbox.schedule(model.queue)
        while self.pull():
            pass
        assert all(model.queue.empty and not model.waiting and not model.leaving for model in self.models)
        assert all(model.queue.pending_bytes == 0 for model in self.models)
        self.outbox.trim()
        assert (self.outbox.urgent_bytes, self.outbox.ordered_bytes, self.outbox.held_bytes) == (0, 0, 0)

    @rule(which=st.integers(0, 2), sizes=SIZES)
    def put_batch(self, which: int, sizes: list[int]) -> None:
        """Publish some messages."""
        model = self.models[which]
        batch, new = model.make(model.next_put, sizes)
        self.outbox.enqueue(model.queue, batch)
        model.waiting += new
        model.next_put += len(sizes)
        self.counted.add(which)

    @rule(which=st.integers(0, 2), size=st.sampled_from([0, 0, 20, 300]), first=st.booleans())
    def put_ordered(self, which: int, size: int, first: bool) -> None:
        """Queue a frame or latched messages, in order with the batches or before them."""
        self.next_token += 1
        item: Replay | bytes = encode(Detached(which, (self.next_token,), 0))
        if size:
            item = Replay(self.next_token, which, *make_batch(0, [bytes(size)])[1:7])
        raw = encode(item) if isinstance(item, Replay) else item
        model = self.models[which]
        self.outbox.enqueue(model.queue, item, first=first)
        model.waiting.insert(0 if first else len(model.waiting), raw)

    @rule()
    def put_control(self) -> None:
        """Queue a control frame."""
        self.next_token += 1
        raw = encode(Ping(self.next_token))
        self.outbox.put_control(raw)
        self.control.append(raw)

    @rule(size=st.sampled_from([1, 300]))
    def put_call(self, size: int) -> None:
        """Queue a small or a large request."""
        self.next_token += 1
        raw = request(self.next_token, size)
        self.outbox.put_calls(raw, (self.endpoint, self.next_token))
        if is_large(raw):
            self.large[self.next_token] = self.endpoint, raw
        else:
            self.calls.append(raw)

    @rule()
    def put_last_word(self) -> None:
        """Remove an endpoint: its UNDECLARE follows its calls."""
        raw = encode(Undeclare(self.endpoint))
        waits = any(endpoint == self.endpoint for endpoint, _ in self.large.values())
        assert self.outbox.put_after_calls(self.endpoint, raw) != waits
        if waits:
            self.behind[self.endpoint] = raw
        else:
            self.calls.append(raw)
        self.endpoint += 1

    def end_large(self, call: int) -> bytes:
        """A large call has come whole, or has been taken back; return it."""
        endpoint, raw = self.large.pop(call)
        if endpoint in self.behind and all(other != endpoint for other, _ in self.large.values()):
            self.calls.append(self.behind.pop(endpoint))
        return raw

    @rule(data=st.data())
    def drop_call(self, data: st.DataObject) -> None:
        """Take a large call back, or one that has left."""
        call = data.draw(st.sampled_from([*self.large, -1]))
        endpoint, _ = self.large.get(call, (1, b""))
        assert self.outbox.drop_call((endpoint, call)) == (call in self.large)
        if call in self.large:
            self.end_large(call)
        self.abort({(Op.REQUEST, call)})

    @rule(which=st.integers(0, 2))
    def drop_queue(self, which: int) -> None:
        """Discard a queue."""
        model = self.models[which]
        assert self.outbox.discard_queue(model.queue) == len(model.messages)
        model.abandoned += sum(isinstance(item, Message) for item in (*model.leaving, *model.waiting))
        model.waiting, model.leaving = [], []
        self.abort({(Op.BATCH, which), (Op.REPLAY, which)})

    def abort(self, gone: set[tuple[int, int]]) -> None:
        """Expect an ABORT for each of these that is leaving in pieces."""
        for transfer, leaving in self.transfers.items():
            if leaving in gone:
                raw = encode(Abort(transfer))
                if raw not in self.control:  # it was aborted before, and that has not been read yet
                    self.control.append(raw)

    @rule(which=st.integers(0, 2), ahead=st.integers(0, 6), room=st.integers(0, 300))
    def grant(self, which: int, ahead: int, room: int) -> None:
        """Set the credit of a queue, possibly to unlimited."""
        model = self.models[which]
        model.queue.sequence_limit = model.next_sent + ahead if ahead else None
        model.queue.byte_limit = model.queue.sent_bytes + room if room else None
        self.outbox.schedule(model.queue)

    @rule()
    def trim(self) -> None:
        """Trim, as after a flush."""
        self.outbox.trim()
        for model in self.models:
            model.trim()
        assert self.outbox.held_bytes == sum(self.models[which].queue.held_bytes for which in self.counted)

    @precondition(lambda self: self.links < 3)
    @rule(largest=st.none() | st.integers(0, 400), again=st.just([]) | SIZES)
    def restart(self, largest: int | None, again: list[int]) -> None:
        """Continue on a new link, possibly with the last messages again."""
        self.links += 1
        self.connect()
        for index, model in enumerate(self.models):
            model.restart(10 * self.links + index)
            model.trim_queue()
            if largest is not None:
                model.drop_larger(largest)
            model.put_front(again)
            model.trim_queue()
            self.outbox.schedule(model.queue)

    @rule(count=st.integers(1, 6))
    def pull_some(self, count: int) -> None:
        """Take some frames."""
        for _ in range(count):
            if not self.pull():
                break

    def pull(self) -> bool:
        """Take one frame and check it as its receiver would."""
        raw = take_one(self.outbox)
        for urgent in (self.control, self.calls):
            if urgent:
                assert raw == urgent.pop(0)
                frame = decode(raw)
                if isinstance(frame, Abort):
                    self.reassembler.abort(frame)
                    del self.transfers[frame.transfer]
                return True
        if raw is None:
            self.check_idle()
            return False
        assert not is_large(raw)
        frame = decode(raw)
        if isinstance(frame, Fragment):
            self.take_fragment(frame)
            return True
        if isinstance(frame, Batch):
            model = self.begin_batch(frame.publisher, frame.length)
            model.arrive(frame)
        else:
            assert isinstance(frame, Detached | Replay)
            assert self.models[frame.publisher].waiting.pop(0) == raw
        return True

    def begin_batch(self, publisher: int, count: int) -> ModelQueue:
        """Check the first fragment of a batch."""
        model = next(model for model in self.models if model.queue.publisher == publisher)
        assert not model.leaving
        model.leave(count)
        return model

    def take_fragment(self, frame: Fragment) -> None:
        """Reassemble a fragment of a large frame."""
        if frame.total is not None:
            unpacker: Any = msgpack.Unpacker()
            unpacker.feed(frame.payload[5:])
            unpacker.read_array_header()
            op, key = unpacker.unpack(), unpacker.unpack()
            if op == Op.BATCH:
                _, _, length = (unpacker.unpack() for _ in range(3))
                key = self.begin_batch(key, length).index
            elif op == Op.REPLAY:
                key = unpacker.unpack()
                self.models[key].leaving = [self.models[key].waiting.pop(0)]
            else:
                unpacker.read_array_header()
                unpacker.read_array_header()
                key = unpacker.unpack()
            self.transfers[frame.transfer] = op, key
        whole = self.reassembler.add(frame)
        if whole is None:
            return
        op, key = self.transfers.pop(frame.transfer)
        arrived = decode(whole)
        if isinstance(arrived, Batch):
            self.models[key].arrive(arrived)
        elif isinstance(arrived, Replay):
            assert self.models[key].leaving == [bytes(whole)]
            self.models[key].leaving = []
        else:
            assert self.end_large(key) == whole

    def check_idle(self) -> None:
        """Check that everything that waits has no credit."""
        assert not self.large
        assert not self.behind
        for model in self.models:
            assert not model.leaving
            if model.waiting:
                assert isinstance(model.waiting[0], Message)
                queue = model.queue
                assert (queue.sequence_limit is not None and model.next_sent >= queue.sequence_limit) or (
                    queue.byte_limit is not None and model.sent_bytes >= queue.byte_limit
                )

    @invariant()
    def counts_are_right(self) -> None:
        """All counts equal those of the model."""
        for model in self.models:
            assert model.queue.pending == len(model.messages)
            assert model.queue.dropped == model.dropped
            assert model.queue.abandoned == model.abandoned
            known = model.dropped + model.abandoned + len(model.messages) + model.queue.leaving
            assert model.queue.sent == model.put - known
            assert model.queue.sent_bytes == model.sent_bytes
            assert model.queue.leaving == sum(isinstance(item, Message) for item in model.leaving)
            assert model.queue.empty == (not model.waiting and not model.leaving)
            assert model.queue.pending_bytes >= sum(len(message.body) for message in model.messages)
            assert not list(of_queue(model.queue))
        large = [raw for _, raw in self.large.values()]
        urgent = [*self.control, *self.calls, *self.behind.values(), *large]
        assert self.outbox.urgent_bytes == memory(urgent)
        assert self.outbox.ordered_bytes == sum(model.ordered_bytes for model in self.models)
        replayed = sum(model.replay_bytes for model in self.models)
        assert (self.outbox.bulk_bytes, self.outbox.replay_bytes) == (memory(large), replayed)
        assert self.outbox.held_bytes == sum(model.queue.counted_bytes for model in self.models)


TestOutboxMachine = OutboxMachine.TestCase
