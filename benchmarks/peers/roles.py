"""A role process and its parent: parameters as one argument, `go` on stdin, `ready` and `done` on stdout.

A role is a function of the `Parent` and its `Parameters`: a coroutine function (it runs on uvloop) or a plain
one (a peer whose fastest form is blocking). It calls `parent.ready()`, awaits `parent.go`, `parent.mark()`s
the begin of its load and gives its figures to `parent.done()`.
"""

from __future__ import annotations

import asyncio
import contextlib
import dataclasses
import importlib
import inspect
import json
import os
import sys
import threading
import time
from collections.abc import Callable, Coroutine, Iterable, Mapping
from concurrent.futures import Future
from pathlib import Path
from typing import Any

import uvloop

GRACE_S = 30
"""How long after its load a role may go on before it gives itself up."""
MATCHING_S = 20
"""How long the roles of a trial may take to find each other."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Parameters:
    """What the parent sends to a role; each role reads what it needs.

    Attributes:
        role: publisher, subscriber, server, requester or idle.
        url: where the peer's server listens, or where its roles may meet if it has none.
        seconds: the length of the load.
        size: bytes of a message.
        readers: how many subscriber processes there are.
        subscriptions: how many subscriptions each of them holds.
        in_flight: how many calls a requester keeps in flight.
        connections: how many connections `idle` holds.
    """

    role: str
    url: str
    seconds: float
    size: int = 0
    readers: int = 1
    subscriptions: int = 1
    in_flight: int = 1
    connections: int = 0

    @classmethod
    def from_json(cls, text: str) -> Parameters:
        """Take what is a parameter here; other workloads' parameters may be there, too."""
        names = {field.name for field in dataclasses.fields(cls)}
        return cls(**{name: value for name, value in json.loads(text).items() if name in names})

    @property
    def host(self) -> str:
        """The host of the url, which ends in host:port."""
        return self.url.rpartition(":")[0].rpartition("/")[2]

    @property
    def port(self) -> int:
        """The port of the url."""
        return int(self.url.rpartition(":")[2])


class Parent:
    """The process that started this one.

    Attributes:
        go: done once the parent has sent `go`.
        closed: done when the parent has closed our stdin, which ends a server and idle connections. Any other
            role exits at once: nobody is left to report to.
    """

    def __init__(self, parameters: Parameters) -> None:
        self.go: Future[None] = Future()
        self.closed: Future[None] = Future()
        self._ends_with_stdin = parameters.role in {"server", "idle"}
        self._limit_s = parameters.seconds + MATCHING_S + GRACE_S
        self._cpu_s = 0.0
        self._reported = False
        threading.Thread(target=self._listen, daemon=True).start()

    def ready(self) -> None:
        """Report that this role is set up."""
        print(json.dumps({"event": "ready"}), flush=True)

    def mark(self) -> None:
        """Begin to count CPU time: the load starts here (else at go)."""
        self._cpu_s = time.process_time()

    def done(self, *, messages: int, **figures: float) -> None:
        """Report, once, at the end of the load."""
        cpu_s = time.process_time() - self._cpu_s
        self._reported = True
        print(json.dumps({"event": "done", "cpu_s": cpu_s, "messages": messages, **figures}), flush=True)

    def _listen(self) -> None:
        # Not sys.stdin: the interpreter cannot end while a thread holds that one's lock.
        with open(0, "rb", buffering=0, closefd=False) as stdin:
            self._obey(stdin)
        if self._ends_with_stdin:
            self.closed.set_result(None)
        elif not self._reported:
            self._give_up("the parent has gone")

    def _obey(self, stdin: Iterable[bytes]) -> None:
        for line in stdin:
            if line.strip() == b"go":
                self.mark()
                if not self._ends_with_stdin:
                    limit = threading.Timer(self._limit_s, self._give_up, ["not done in time"])
                    limit.daemon = True
                    limit.start()
                self.go.set_result(None)

    def _give_up(self, reason: str) -> None:
        # From a thread, while the load may be in a native call: no gentler way ends for certain.
        print(reason, file=sys.stderr, flush=True)
        os._exit(1)


Role = Callable[[Parent, Parameters], Coroutine[Any, Any, None] | None]


def run(roles: Mapping[str, Role], argument: str) -> None:
    """Be the role that the parameters (JSON) name."""
    parameters = Parameters.from_json(argument)
    with contextlib.suppress(KeyboardInterrupt):
        outcome = roles[parameters.role](Parent(parameters), parameters)
        if inspect.iscoroutine(outcome):
            uvloop.run(outcome)


async def until(future: Future[None]) -> None:
    """Wait in the event loop for what the parent does."""
    await asyncio.wrap_future(future)


def library(name: str) -> Any:
    """A peer's library, imported when it is used: the type checks must not depend on what is installed."""
    return importlib.import_module(name)


def command(peer: str) -> tuple[str, ...]:
    """What starts a role of the peer (but for its parameters)."""
    return (sys.executable, str(Path(__file__).parent), peer)
