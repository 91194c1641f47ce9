"""iceoryx2: shared memory between publisher and subscriber, without a broker and without sockets.

The `iceoryx2` wheel is Rust. A message is copied once into a loaned slice and once out of the sample, as
everywhere else. The service keeps what its subscribers are too slow for, and its publisher waits for them
(RETRY_UNTIL_DELIVERED); a subscriber sleeps until an event wakes it. Acknowledgements travel as messages of a
second service. It has no asyncio form; calls exist, but are not what it is compared for.
"""

from __future__ import annotations

import ctypes
from importlib import metadata
from typing import TYPE_CHECKING, Any

from benchmarks.harness.contender import Contender
from benchmarks.peers import stream
from benchmarks.peers.roles import Parameters, Parent, command, library

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

BUFFER_BYTES = 8 << 20
BUFFER_MESSAGES = 1024
MAX_READERS = 64
LOOK_S = 0.1
"""After so long a role looks again, whether or not an event has come."""


class Pipe:
    """One service, and the event that wakes its readers.

    Args:
        node: The process's node.
        name: The service's name.
        size: Bytes of the largest message.
    """

    def __init__(self, node: Any, name: str, size: int) -> None:
        self.iox: Any = library("iceoryx2")
        self._size = max(size, 16) + 1
        buffer = max(4, min(BUFFER_MESSAGES, BUFFER_BYTES // self._size))
        self._service = (
            node.service_builder(self.iox.ServiceName.new(name))
            .publish_subscribe(self.iox.Slice[ctypes.c_uint8])
            .enable_safe_overflow(False)  # noqa: FBT003 - its only form
            .subscriber_max_buffer_size(buffer)
            .max_subscribers(MAX_READERS)
            .max_publishers(MAX_READERS)
            .max_nodes(MAX_READERS)
            .open_or_create()
        )
        self._event = (
            node.service_builder(self.iox.ServiceName.new(f"{name}/event"))
            .event()
            .max_nodes(MAX_READERS)
            .max_listeners(MAX_READERS)
            .max_notifiers(MAX_READERS)
            .open_or_create()
        )

    def sender(self) -> Callable[[bytes], None]:
        """Return a function that sends bytes, and waits while a reader is full."""
        publisher = (
            self._service.publisher_builder()
            .initial_max_slice_len(self._size)
            .backpressure_strategy(self.iox.BackpressureStrategy.RetryUntilDelivered)
            .create()
        )
        notifier = self._event.notifier_builder().create()
        loan, notify = publisher.loan_slice_uninit, notifier.notify

        def send(data: bytes) -> None:
            sample = loan(len(data) + 1)  # a slice cannot be empty
            sample.payload().as_memory_view().cast("B")[1:] = data
            sample.assume_init().send()
            notify()

        return send

    def receiver(self, subscriptions: int = 1) -> Callable[[float], Iterator[bytes]]:
        """Return a function that waits some seconds for messages and iterates over them."""
        subscribers = [self._service.subscriber_builder().create() for _ in range(subscriptions)]
        listener = self._event.listener_builder().create()
        wait, milliseconds = listener.timed_wait, self.iox.Duration.from_millis

        def received(timeout_s: float) -> Iterator[bytes]:
            wait(milliseconds(round(1000 * timeout_s)))
            for subscriber in subscribers:
                while (sample := subscriber.receive()) is not None:
                    data = bytes(sample.payload().as_memory_view().cast("B")[1:])
                    sample.delete()
                    yield data

        return received


def _pipes(parameters: Parameters) -> tuple[Any, Pipe, Pipe]:
    """Return the process's node, the stream and the way of acknowledgements."""
    iox: Any = library("iceoryx2")
    iox.set_log_level(iox.LogLevel.Error)
    node = iox.NodeBuilder.new().create(iox.ServiceType.Ipc)
    name = f"callboard benchmark/{parameters.port}"
    return node, Pipe(node, name, parameters.size), Pipe(node, f"{name}/acknowledgements", 16)


def publisher(parent: Parent, parameters: Parameters) -> None:
    """Send, and wait where a reader is full."""
    _node, messages, acknowledgements = _pipes(parameters)
    send, received = messages.sender(), acknowledgements.receiver()
    readers = stream.Readers(parameters)
    waiting: list[bytes] = []

    def receive(timeout_s: float) -> bytes | None:
        if not waiting:
            waiting.extend(received(timeout_s))
        return waiting.pop(0) if waiting else None

    parent.ready()
    parent.go.result()
    stream.match_readers(readers, lambda: send(stream.PROBE), receive)
    sent = stream.publish_blocking(parent, parameters, send)
    stream.wait_for_end(readers, sent, receive)
    parent.done(messages=sent, sent=sent)


def subscriber(parent: Parent, parameters: Parameters) -> None:
    """Count what comes."""
    _node, messages, acknowledgements = _pipes(parameters)
    acknowledge, received = acknowledgements.sender(), messages.receiver(parameters.subscriptions)
    tally = stream.Tally(parameters)
    parent.ready()
    while not tally.finished:
        for data in received(LOOK_S):
            if (answer := tally.take(data)) is not None:
                acknowledge(answer)
    tally.report(parent)


ROLES = {"publisher": publisher, "subscriber": subscriber}


def find() -> Contender | str:
    """The contender, or why there is none."""
    try:
        version = metadata.version("iceoryx2")
    except metadata.PackageNotFoundError:
        return "iceoryx2 is not installed (PyPI: iceoryx2)"
    return Contender(
        name="iceoryx2",
        version=f"iceoryx2 {version} (native, blocking)",
        brokered=False,
        role_command=command("iceoryx2"),
        server_command=None,
        server_url=lambda port: f"iceoryx2://127.0.0.1:{port}",
        roles=frozenset(ROLES),
    )
