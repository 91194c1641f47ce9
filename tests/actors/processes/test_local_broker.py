"""A broker that is started where none answers: once, in a process of its own, and with a clear error."""

from __future__ import annotations

import os
import signal
import socket
import subprocess
import sys
import threading
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from actors.config.contexts import find_broker_target
from actors.errors import BrokerUnreachable
from actors.graph.inspector import inspector_for
from actors.processes import local_broker
from actors.processes.local_broker import (
    BrokerStartError,
    LocalBroker,
    can_start_at,
    ensure_local_broker,
    keep_local_broker,
)
from proto.wire.url import parse_url

if TYPE_CHECKING:
    from collections.abc import Iterator

    from actors.config.contexts import BrokerTarget

DEADLINE_SEC = 30


@pytest.fixture
def target(tmp_path: Path) -> BrokerTarget:
    """A broker's address where nobody listens."""
    return find_broker_target(f"callboard+unix://{tmp_path}/s")


@pytest.fixture
def started(target: BrokerTarget, monkeypatch: pytest.MonkeyPatch) -> Iterator[list[LocalBroker]]:
    """Brokers that a test has started; they are stopped."""
    monkeypatch.setenv("XDG_STATE_HOME", str(Path(target.urls[0].path).parent))
    brokers: list[LocalBroker] = []
    yield brokers
    for each in brokers:
        os.kill(each.pid, signal.SIGTERM)
        assert os.waitpid(each.pid, 0) == (each.pid, 0)


@pytest.mark.processes
def test_it_is_started_only_where_none_answers(target: BrokerTarget, started: list[LocalBroker]) -> None:
    """It listens when the call returns, has a session of its own, and a log; the second call starts none."""
    found = ensure_local_broker(target)
    assert found is not None
    started.append(found)
    with inspector_for(target, DEADLINE_SEC):
        assert ensure_local_broker(target) is None
    assert os.getsid(found.pid) == found.pid
    assert Path(found.log).is_file()
    assert str(found) == (
        f"Started a broker at {target.url} (pid {found.pid}, log {found.log}), which ends when idle for 10 s"
    )


@pytest.mark.processes
def test_of_several_starters_one_starts_it(target: BrokerTarget, started: list[LocalBroker]) -> None:
    """All return at the moment when a broker answers, whoever has started it."""
    ready = threading.Barrier(3)

    def start(_number: int) -> LocalBroker | None:
        ready.wait(DEADLINE_SEC)
        return ensure_local_broker(target)

    with ThreadPoolExecutor(3) as pool:
        started += [each for each in pool.map(start, range(3)) if each is not None]
    assert len(started) == 1
    with inspector_for(target, DEADLINE_SEC):
        pass


@pytest.mark.parametrize(
    "url",
    ["callboard://192.0.2.1:7411", "callboards://localhost:1", "callboard://localhost:1,callboard://x:1"],
)
def test_none_is_started_for_other_machines_or_tls(url: str) -> None:
    """Nothing is asked there: a node that connects gets the error, or the broker."""
    assert ensure_local_broker(find_broker_target(url), start_timeout_sec=0) is None


@pytest.mark.parametrize(
    "url",
    ["callboard://127.0.0.2:1", "callboard://localhost:1", "callboard://[::1]:1", "callboard+unix:///s"],
)
def test_one_can_be_started_at_every_loopback_address_and_socket(url: str) -> None:
    """Also by a launch: both ask this."""
    assert can_start_at(parse_url(url))


def test_none_is_started_where_another_program_listens(target: BrokerTarget) -> None:
    """It could not listen."""
    with socket.socket(socket.AF_UNIX) as server:
        server.bind(target.urls[0].path)
        server.listen()
        with ThreadPoolExecutor(1) as pool:
            accepted = pool.submit(server.accept)
            accepted.add_done_callback(lambda done: done.result()[0].close())
            assert ensure_local_broker(target, start_timeout_sec=0) is None


@pytest.mark.processes
def test_the_error_has_what_the_broker_said(tmp_path: Path, started: list[LocalBroker]) -> None:
    """A socket file in a folder that does not exist."""
    assert not started
    with pytest.raises(
        BrokerStartError, match=r"^Cannot start a broker at .*/none/s: Cannot listen on .*No such"
    ):
        ensure_local_broker(find_broker_target(f"callboard+unix://{tmp_path}/none/s"))


def test_a_broker_that_is_too_slow_is_ended(target: BrokerTarget, started: list[LocalBroker]) -> None:
    """The error says how long it had, and nobody listens later."""
    assert not started
    with pytest.raises(BrokerStartError, match="has not listened within 0 s"):
        ensure_local_broker(target, start_timeout_sec=0)
    with pytest.raises(BrokerUnreachable, match="No broker at"), inspector_for(target, DEADLINE_SEC):
        pass


@pytest.mark.processes
def test_the_log_has_a_limit(
    target: BrokerTarget, started: list[LocalBroker], monkeypatch: pytest.MonkeyPatch
) -> None:
    """One that has become long is emptied when the next broker starts."""
    monkeypatch.setattr(local_broker, "MAX_LOG_BYTES", 10)
    first = ensure_local_broker(target)
    assert first is not None
    os.kill(first.pid, signal.SIGTERM)
    os.waitpid(first.pid, 0)
    Path(first.log).write_text("a line that is long\n")
    found = ensure_local_broker(target)
    assert found is not None
    started.append(found)
    assert found.log == first.log
    assert "a line" not in Path(found.log).read_text()


@pytest.mark.processes
def test_it_starts_without_a_log(
    target: BrokerTarget, started: list[LocalBroker], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """On a machine where the user may write nowhere."""
    (tmp_path / "file").touch()
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "file"))
    found = ensure_local_broker(target)
    assert found is not None
    started.append(found)
    assert found.log == ""
    assert ", log" not in str(found)


@pytest.mark.processes
def test_it_is_kept_for_the_life_of_a_process(
    target: BrokerTarget, started: list[LocalBroker], monkeypatch: pytest.MonkeyPatch
) -> None:
    """The process is one of its clients before it has a node; the broker ends when the process has ended."""
    assert not started
    monkeypatch.setattr(local_broker, "IDLE_SEC", 5.0)  # to connect, on a busy machine
    found = ensure_local_broker(target)
    assert found is not None
    program = (
        "import sys; from actors.config.contexts import find_broker_target;"
        "from actors.processes.local_broker import keep_local_broker;"
        "keep_local_broker(find_broker_target(sys.argv[1])); print('kept', flush=True); sys.stdin.read()"
    )
    with (
        inspector_for(target, DEADLINE_SEC) as inspector,
        subprocess.Popen(
            [sys.executable, "-c", program, target.url], stdin=subprocess.PIPE, stdout=subprocess.PIPE
        ) as process,
    ):
        assert process.stdout is not None
        assert process.stdout.readline() == b"kept\n"
        assert inspector.report().totals.connections == 2
    assert os.waitpid(found.pid, 0) == (found.pid, 0)


def test_what_does_not_answer_is_not_kept(target: BrokerTarget) -> None:
    """Neither where nobody listens nor on other machines."""
    before = set(threading.enumerate())
    keep_local_broker(target)
    keep_local_broker(find_broker_target("callboard://192.0.2.1:7411"))
    assert set(threading.enumerate()) <= before
