"""Zenoh's roles, the same with a router between them and without.

The `eclipse-zenoh` wheel is Rust under a blocking API with callbacks; it has no asyncio form. A declared
publisher puts with congestion control BLOCK over a reliable transport, so that nothing is dropped and the
library batches as it likes. A subscriber's callback runs where the library runs callbacks by default, in a
Python thread fed by a bounded queue: six times the rate of a callback in the receiving thread, which takes
the interpreter's lock for each message. Calls are a declared querier, whose replies the main thread takes out
of the library's own queues, and a queryable that answers in the receiving thread; both are express (not held
back for a batch). That is the fastest of the combinations: a callback for each `get` starts a thread each
time.

Scouting is off and links are TCP on 127.0.0.1. By default the library passes payloads of 3 KiB and more
through shared memory where both ends are on one machine. That is off here, because the others' bytes all go
through sockets, and Zenoh's would, too, between machines; zenoh_shared_memory.py measures it switched on.
"""

from __future__ import annotations

import json
import queue
import threading
from collections import deque
from collections.abc import Callable
from typing import Any

from benchmarks.peers import calls, stream
from benchmarks.peers.roles import Parameters, Parent, library

KEY = "bench/stream"
ACKNOWLEDGEMENTS = "bench/acknowledgements"
ADD = "bench/add"
RETRY = {"period_init_ms": 20, "period_max_ms": 100, "period_increase_factor": 1}

Open = Callable[[Parameters], Any]


def configuration(mode: str, *, shared_memory: bool = False, **settings: object) -> Any:
    """A configuration without scouting; settings are named by their path, with __ for /."""
    config = library("zenoh").Config()
    config.insert_json5("mode", json.dumps(mode))
    config.insert_json5("scouting/multicast/enabled", "false")
    config.insert_json5("scouting/gossip/enabled", "false")
    config.insert_json5("transport/shared_memory/enabled", json.dumps(shared_memory))
    for name, value in settings.items():
        config.insert_json5(name.replace("__", "/"), json.dumps(value))
    return config


def directly(callback: Callable[[Any], None]) -> Any:
    """A callback in the receiving thread, without the change of threads that costs a single call time."""
    return library("zenoh").handlers.Callback(callback, indirect=False)


def declare_publisher(session: Any, key: str, *, express: bool) -> Any:
    """A publisher that drops nothing."""
    zenoh = library("zenoh")
    return session.declare_publisher(
        key,
        congestion_control=zenoh.CongestionControl.BLOCK,
        reliability=zenoh.Reliability.RELIABLE,
        express=express,
    )


def publisher(parent: Parent, parameters: Parameters, open_session: Open) -> None:
    """Put as fast as BLOCK lets us."""
    readers = stream.Readers(parameters)
    mailbox: queue.SimpleQueue[bytes] = queue.SimpleQueue()
    receive = stream.receive_from(mailbox)

    def on_acknowledgement(sample: Any) -> None:
        mailbox.put(sample.payload.to_bytes())

    with open_session(parameters) as session:
        session.declare_subscriber(ACKNOWLEDGEMENTS, on_acknowledgement)
        publication = declare_publisher(session, KEY, express=False)
        parent.ready()
        parent.go.result()
        stream.match_readers(readers, lambda: publication.put(stream.PROBE), receive)
        sent = stream.publish_blocking(parent, parameters, publication.put)
        stream.wait_for_end(readers, sent, receive)
        parent.done(messages=sent, sent=sent)


def subscriber(parent: Parent, parameters: Parameters, open_session: Open) -> None:
    """Count in the callback; the payload is taken out as bytes, as an application would."""
    tally = stream.Tally(parameters)
    finished = threading.Event()
    with open_session(parameters) as session:
        acknowledge = declare_publisher(session, ACKNOWLEDGEMENTS, express=True)

        def on_sample(sample: Any) -> None:
            acknowledgement = tally.take(sample.payload.to_bytes())
            if acknowledgement is not None:
                acknowledge.put(acknowledgement)
                if tally.finished:
                    finished.set()

        for _ in range(parameters.subscriptions):
            session.declare_subscriber(KEY, on_sample)
        parent.ready()
        finished.wait()
        tally.report(parent)


def server(parent: Parent, parameters: Parameters, open_session: Open) -> None:
    """Answer queries until the parent closes our stdin."""
    served = 0

    def on_query(query: Any) -> None:
        nonlocal served
        served += 1
        with query:
            query.reply(ADD, calls.reply(query.payload.to_bytes()), express=True)

    with open_session(parameters) as session:
        session.declare_queryable(ADD, directly(on_query), complete=True)
        parent.ready()
        parent.closed.result()
        parent.done(messages=served, served=served)


def requester(parent: Parent, parameters: Parameters, open_session: Open) -> None:
    """Query, and take the replies in the order of the queries."""
    zenoh = library("zenoh")
    replies: deque[tuple[int, Any]] = deque()

    matched = threading.Event()

    def on_matching(status: Any) -> None:
        if status.matching:
            matched.set()

    def send(number: int) -> None:
        replies.append((number, querier.get(payload=calls.request(number))))

    with open_session(parameters) as session:
        querier = session.declare_querier(
            ADD,
            target=zenoh.QueryTarget.BEST_MATCHING,
            consolidation=zenoh.ConsolidationMode.NONE,
            congestion_control=zenoh.CongestionControl.BLOCK,
            express=True,
            timeout=calls.CALL_S,
        )
        turns = calls.Turns(parent, parameters, send)
        querier.declare_matching_listener(on_matching)
        parent.ready()
        parent.go.result()
        if not querier.matching_status and not matched.wait(calls.CALL_S):
            raise TimeoutError("no queryable is seen")
        turns.begin()
        while not turns.finished:
            number, handler = replies.popleft()
            turns.take(number, handler.recv().ok.payload.to_bytes())
        turns.report()


def roles(open_session: Open) -> dict[str, Callable[[Parent, Parameters], None]]:
    """The roles, with sessions of that kind."""

    def bind(role: Callable[[Parent, Parameters, Open], None]) -> Callable[[Parent, Parameters], None]:
        return lambda parent, parameters: role(parent, parameters, open_session)

    return {role.__name__: bind(role) for role in (publisher, subscriber, server, requester)}
