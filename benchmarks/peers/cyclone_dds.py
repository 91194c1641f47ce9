"""Cyclone DDS with its own Python binding: reliable, KEEP_ALL, on loopback in a domain of its own.

The binding is C under a blocking API; its asyncio form is a thread around that. Writers block when their
history is full. A reader's history has no limit: one that is full rejects samples, which the writer then
repeats, at half the rate, and to the other readers of the process as well. The main thread sleeps in a
WaitSet and takes what is there in one call (a listener would enter Python for each message). The payload is
an array of octets, which the binding passes as bytes (a sequence it packs octet by octet, 200 times slower at
64 KiB). Fragments and datagrams are as large as UDP allows, as its documentation advises for throughput.
Calls are two topics, requests and replies with a number to tell them apart. There is no server.
"""

from __future__ import annotations

import dataclasses
import time
from collections import deque
from importlib import metadata
from typing import TYPE_CHECKING, Any

from benchmarks.harness.contender import Contender
from benchmarks.peers import calls, stream
from benchmarks.peers.roles import MATCHING_S, Parameters, Parent, command, library

if TYPE_CHECKING:
    from collections.abc import Callable

STREAM = "bench"
ACKNOWLEDGEMENTS = "bench_acknowledgements"
REQUESTS = "bench_requests"
REPLIES = "bench_replies"
DOMAINS = 200
"""Domains are numbers below 230, for their UDP ports' sake."""
SECOND_NS = 10**9
WAIT_NS = SECOND_NS // 10
"""How long a reader waits before it looks for what else has happened."""
TAKEN_AT_ONCE = 1000
ACKNOWLEDGEMENT_BYTES = 16
MATCHING_CALL = 0
"""The number of the calls before the first."""
BLOCKED_S = 30

CONFIGURATION = """<CycloneDDS><Domain id="any">
<General>
  <Interfaces><NetworkInterface name="lo"/></Interfaces>
  <AllowMulticast>false</AllowMulticast>
  <MaxMessageSize>65500B</MaxMessageSize>
  <FragmentSize>65000B</FragmentSize>
</General>
<Discovery>
  <ParticipantIndex>auto</ParticipantIndex>
  <MaxAutoParticipantIndex>20</MaxAutoParticipantIndex>
  <Peers><Peer address="127.0.0.1"/></Peers>
</Discovery>
<Internal>
  <SocketReceiveBufferSize min="default" max="8MiB"/>
  <Watermarks><WhcHigh>8MiB</WhcHigh></Watermarks>
</Internal>
</Domain></CycloneDDS>"""


class Bus:
    """A participant of the domain, whose topics carry arrays of octets."""

    def __init__(self, parameters: Parameters) -> None:
        self._context, self._idl = library("cyclonedds.context"), library("cyclonedds.idl")
        self._types, self._qos = library("cyclonedds.idl.types"), library("cyclonedds.qos")
        self._publishers, self._subscribers = library("cyclonedds.pub"), library("cyclonedds.sub")
        self._topics = library("cyclonedds.topic")
        domain = library("cyclonedds.domain")
        number = parameters.port % DOMAINS
        self._domain = domain.Domain(number, CONFIGURATION)
        self._participant = domain.DomainParticipant(number)
        self._writers: list[Any] = []
        self._waits = self._context.WaitSet(self._participant)

    def write_to(self, topic: str, size: int) -> Callable[[bytes], None]:
        """A writer, as what writes so many octets."""
        octets = self._octets(size)
        writer = self._publishers.DataWriter(
            self._participant, self._topics.Topic(self._participant, topic, octets), self._quality()
        )

        self._writers.append(writer)

        def write(data: bytes) -> None:
            writer.write(octets(data=data))

        return write

    def read_from(self, topic: str, size: int) -> Callable[[], list[bytes]]:
        """A reader, as what takes all that is there; its data wakes `wait` up."""
        quality = self._quality()
        reader = self._subscribers.DataReader(
            self._participant,
            self._topics.Topic(self._participant, topic, self._octets(size)),
            quality,
        )
        # Alive: not the news that a writer has gone.
        states = (
            self._context.ViewState.Any | self._context.InstanceState.Alive | self._context.SampleState.Any
        )
        condition = self._context.ReadCondition(reader, states)
        self._waits.attach(condition)
        return lambda: [sample.data for sample in reader.take(TAKEN_AT_ONCE, condition)]

    def wait(self, timeout_ns: int = WAIT_NS) -> None:
        """Wait until a reader has data, or for that time."""
        self._waits.wait(timeout_ns)

    def drain(self) -> None:
        """Wait until what was written has arrived: it would go with its writer."""
        for writer in self._writers:
            writer.wait_for_acks(BLOCKED_S * SECOND_NS)

    def _octets(self, size: int) -> Any:
        # Made here: a type that depends on a parameter cannot be written down as a class.
        array = self._types.array[self._types.uint8, size]
        return dataclasses.make_dataclass("Octets", [("data", array)], bases=(self._idl.IdlStruct,))

    def _quality(self) -> Any:
        policy = self._qos.Policy
        return self._qos.Qos(
            policy.Reliability.Reliable(max_blocking_time=BLOCKED_S * SECOND_NS),
            policy.History.KeepAll,
        )


def pad(mark: bytes, size: int) -> bytes:
    """A mark as an array of the stream's size: its length, which no load begins with, itself, nothing."""
    return bytes([len(mark) + 1]) + mark + bytes(size - len(mark) - 1)


def unpad(data: bytes) -> bytes:
    """The mark in an array."""
    return data[1 : data[0]]


def publisher(parent: Parent, parameters: Parameters) -> None:
    """Write until the history is full, and wait there."""
    bus, size = Bus(parameters), parameters.size
    write = bus.write_to(STREAM, size)
    acknowledgements = bus.read_from(ACKNOWLEDGEMENTS, ACKNOWLEDGEMENT_BYTES)
    readers = stream.Readers(parameters)
    received: deque[bytes] = deque()

    def receive(timeout_s: float) -> bytes | None:
        if not received:
            bus.wait(round(timeout_s * SECOND_NS))
            received.extend(acknowledgements())
        return received.popleft() if received else None

    def send(data: bytes) -> None:
        write(data if len(data) == size else pad(data, size))

    parent.ready()
    parent.go.result()
    stream.match_readers(readers, lambda: send(stream.PROBE), receive)
    sent = stream.publish_blocking(parent, parameters, send)
    stream.wait_for_end(readers, sent, receive)
    parent.done(messages=sent, sent=sent)


def subscriber(parent: Parent, parameters: Parameters) -> None:
    """Take from each of the subscriptions' readers all that is there."""
    bus = Bus(parameters)
    acknowledge = bus.write_to(ACKNOWLEDGEMENTS, ACKNOWLEDGEMENT_BYTES)
    subscriptions = [bus.read_from(STREAM, parameters.size) for _ in range(parameters.subscriptions)]
    tally = stream.Tally(parameters)
    probed: set[int] = (
        set()
    )  # readers are matched in their own time: a probe is answered when all have had one
    parent.ready()
    while not tally.finished:
        bus.wait()
        for number, read in enumerate(subscriptions):
            for data in read():
                acknowledgement = tally.take(unpad(data) if data[0] else data)
                if acknowledgement is not None:
                    probed.add(number)
                    if len(probed) == parameters.subscriptions:
                        acknowledge(acknowledgement)
    tally.report(parent)
    bus.drain()


def server(parent: Parent, parameters: Parameters) -> None:
    """Answer requests until the parent closes our stdin."""
    bus = Bus(parameters)
    reply = bus.write_to(REPLIES, calls.NUMBERED_REPLY_BYTES)
    requests = bus.read_from(REQUESTS, calls.NUMBERED_REQUEST_BYTES)
    served = 0
    parent.ready()
    while not parent.closed.done():
        bus.wait()
        for data in requests():
            reply(calls.numbered_reply(data))
            served += 1
    parent.done(messages=served, served=served)
    bus.drain()


def requester(parent: Parent, parameters: Parameters) -> None:
    """Write requests and take replies from the topic of all replies."""
    bus = Bus(parameters)
    request = bus.write_to(REQUESTS, calls.NUMBERED_REQUEST_BYTES)
    replies = bus.read_from(REPLIES, calls.NUMBERED_REPLY_BYTES)
    turns = calls.Turns(parent, parameters, lambda number: request(calls.numbered_request(number)))
    parent.ready()
    parent.go.result()
    match(bus, request, replies)
    turns.begin()
    while not turns.finished:
        bus.wait()
        for numbered in replies():
            number, data = calls.split_number(numbered)
            if number != MATCHING_CALL:
                turns.take(number, data)
    turns.report()


def match(bus: Bus, request: Callable[[bytes], None], replies: Callable[[], list[bytes]]) -> None:
    """Call until there is a reply: only then do both sides know both topics."""
    deadline_s = time.monotonic() + MATCHING_S
    while not replies():
        if time.monotonic() > deadline_s:
            raise TimeoutError("no server answers")
        request(calls.numbered_request(MATCHING_CALL))
        bus.wait()


ROLES = {"publisher": publisher, "subscriber": subscriber, "server": server, "requester": requester}


def find() -> Contender | str:
    """The contender, or why there is none."""
    try:
        version = metadata.version("cyclonedds")
    except metadata.PackageNotFoundError:
        return "cyclonedds is not installed (PyPI: cyclonedds)"
    return Contender(
        name="cyclonedds",
        version=f"cyclonedds {version} (native, blocking)",
        brokered=False,
        role_command=command("cyclone_dds"),
        server_command=None,
        server_url=lambda port: f"dds://127.0.0.1:{port}",  # the port stands for the domain
        roles=frozenset(ROLES),
    )
