"""Nodes in a thread: calls from other threads, their errors, and how the thread ends."""

from __future__ import annotations

import asyncio
import os
import signal
import subprocess
import sys
import threading
from contextlib import asynccontextmanager
from queue import Queue
from typing import TYPE_CHECKING, Any

import pytest

import actors
from actors.interfaces.example_interfaces.srv import AddTwoInts
from actors.threads import NodeThread, ThreadStopped, TooManyCalls
from tests.actors.meeting import DEADLINE_SEC
from tests.seams.limits import set_limits

if TYPE_CHECKING:
    from collections.abc import AsyncGenerator, Callable

    from tests.actors.threads.conftest import Host


class Endless:
    """A coroutine that waits for ever, and shows that it runs and that it was cancelled."""

    def __init__(self) -> None:
        self.running, self.cancelled = threading.Event(), threading.Event()

    async def wait(self) -> None:
        self.running.set()
        try:
            await asyncio.Event().wait()
        except asyncio.CancelledError:
            self.cancelled.set()
            raise


async def raises(error: BaseException) -> None:
    raise error


def test_nodes_are_entered_used_and_left(host: Host) -> None:
    """A service in one thread is called from another one; after `leave` it is gone."""

    def add(request: AddTwoInts.Request) -> AddTwoInts.Response:
        return AddTwoInts.Response(sum=request.a + request.b)

    server = host.node("server")
    server.create_service(AddTwoInts, "add", add)
    assert host.thread.enter(server) is server
    with NodeThread("client") as thread:
        node = thread.enter(host.node("client"))
        client = thread.call(lambda: node.create_client(AddTwoInts, "add"))
        assert thread.call(client.wait_for_service)
        assert thread.call(client.call(AddTwoInts.Request(a=2, b=3))).sum == 5
        host.thread.leave(server)
        with pytest.raises(actors.ServiceUnavailable):
            thread.call(client.call(AddTwoInts.Request()))
        with pytest.raises(LookupError, match="has not been entered"):
            host.thread.leave(server)


def test_contexts_are_left_in_reverse_order_by_the_task_that_entered_them() -> None:
    """As by `async with`; `enter` returns their values, and `leave` takes one of them."""
    events: list[tuple[str, int, object]] = []

    @asynccontextmanager
    async def context(number: int) -> AsyncGenerator[int]:
        events.append(("enter", number, asyncio.current_task()))
        yield number
        events.append(("leave", number, asyncio.current_task()))

    with NodeThread() as thread:
        assert [thread.enter(context(number)) for number in range(5, 9)] == [5, 6, 7, 8]
        thread.leave(6)  # type: ignore[arg-type]  # pyright: ignore[reportArgumentType]
    assert [number for _, number, _ in events[4:]] == [6, 8, 7, 5]
    tasks = {number: task for _, number, task in events[:4]}
    assert all(task is tasks[number] for _, number, task in events)
    assert len(set(tasks.values())) == 4


def test_results_and_errors_reach_the_caller() -> None:
    """Of coroutines, functions, and functions that return coroutines; errors are the same objects."""

    async def add(a: int, b: int) -> int:
        return a + b

    with NodeThread() as thread:
        assert thread.call(add(1, 2)) == 3
        assert thread.call(lambda: 4) == 4
        assert thread.call(lambda: add(5, 6)) == 11
        assert thread.submit(add(7, 8)).result(DEADLINE_SEC) == 15
        error = LookupError("nothing here")
        for work in (raises(error), lambda: raises(error)):
            with pytest.raises(LookupError) as caught:
                thread.call(work)
            assert caught.value is error
        with pytest.raises(ZeroDivisionError):
            thread.call(lambda: 1 // 0)
        with pytest.raises(actors.CallCancelled):
            thread.call(raises(asyncio.CancelledError()))
        with pytest.raises(TimeoutError) as timeout:  # the coroutine's own
            thread.call(raises(TimeoutError("slow")), timeout_sec=DEADLINE_SEC)
        assert not isinstance(timeout.value, actors.WaitTimeout)


def test_what_cannot_be_run_is_an_error() -> None:
    """Such as the result of a function that was called outside of the loop."""
    result: Any = 5
    with NodeThread() as thread:
        for use in (thread.call, thread.submit):
            with pytest.raises(TypeError, match=r"Expected a coroutine or a function, .* not 5"):
                use(result)
        assert thread.call(lambda: result) == 5


def test_a_call_is_cancelled_when_its_time_is_over() -> None:
    """It raises WaitTimeout, and the coroutine is cancelled."""
    endless = Endless()
    with NodeThread() as thread:
        while not endless.running.is_set():  # the time may be over before it begins
            with pytest.raises(actors.WaitTimeout, match=r"within 0\.01 s"):
                thread.call(endless.wait, timeout_sec=0.01)
        assert endless.cancelled.wait(DEADLINE_SEC)


def test_a_future_can_be_cancelled() -> None:
    """The coroutine is cancelled; one that has not begun never begins."""
    endless, late, gate = Endless(), Endless(), threading.Event()
    with NodeThread() as thread:
        future = thread.submit(endless.wait())
        assert endless.running.wait(DEADLINE_SEC)
        assert future.cancel()
        assert endless.cancelled.wait(DEADLINE_SEC)
        thread.submit(lambda: gate.wait(DEADLINE_SEC))
        assert thread.submit(late.wait()).cancel()
        gate.set()
        thread.call(lambda: None)
        assert not late.running.is_set()


def test_the_number_of_calls_is_limited(monkeypatch: pytest.MonkeyPatch) -> None:
    """One too many is refused, and not made; when one has ended another one can be made."""
    set_limits(monkeypatch, thread_calls=2)
    with NodeThread("worker") as thread:
        first, _ = thread.submit(Endless().wait), thread.submit(Endless().wait)
        with pytest.raises(TooManyCalls, match="2 calls in 'worker' have not ended"):
            thread.call(Endless().wait())
        first.cancel()
        while True:  # the call ends soon
            try:
                assert thread.call(lambda: 1) == 1
                break
            except TooManyCalls:
                continue


@pytest.mark.skipif(not hasattr(signal, "pthread_kill"), reason="needs pthread_kill")
def test_ctrl_c_cancels_the_call() -> None:
    """The main thread gets KeyboardInterrupt at once, and the thread goes on."""
    main, interrupted, endless = threading.get_ident(), threading.Event(), Endless()
    assert main == threading.main_thread().ident

    def interrupt(number: int, frame: object) -> None:
        if not interrupted.is_set():
            interrupted.set()
            raise KeyboardInterrupt

    def press_ctrl_c() -> None:
        assert endless.running.wait(DEADLINE_SEC)
        while not interrupted.wait(0.05):  # Python misses a signal while it is about to wait for a lock
            signal.pthread_kill(main, signal.SIGINT)

    before = signal.signal(signal.SIGINT, interrupt)
    user = threading.Thread(target=press_ctrl_c)
    user.start()
    try:
        with NodeThread() as thread:
            with pytest.raises(KeyboardInterrupt):
                thread.call(endless.wait)
            assert endless.cancelled.wait(DEADLINE_SEC)
            assert thread.call(lambda: 1) == 1
    finally:
        user.join()
        signal.signal(signal.SIGINT, before)


def test_stopping_ends_calls_that_run() -> None:
    """They raise ThreadStopped, also if the loop is blocked; the coroutines are cancelled."""
    endless, blocked, gate = Endless(), threading.Event(), threading.Event()

    def block() -> None:
        blocked.set()
        gate.wait(DEADLINE_SEC)

    with NodeThread("worker") as thread:
        running = thread.submit(endless.wait)
        assert endless.running.wait(DEADLINE_SEC)
        blocking, waiting = thread.submit(block), thread.submit(Endless().wait())
        assert blocked.wait(DEADLINE_SEC)
        with pytest.raises(actors.WaitTimeout, match="'worker' did not end within 0 s: a callback blocks it"):
            thread.stop(timeout_sec=0)
        for future in (running, blocking, waiting):
            with pytest.raises(ThreadStopped, match="'worker' has been stopped"):
                future.result(0)
        assert not endless.cancelled.is_set()
        gate.set()
    assert endless.cancelled.is_set()
    assert thread.ended.result(0) is None


def test_a_thread_that_does_not_run_refuses_calls() -> None:
    """Before its start and after its stop; it runs once."""
    thread = NodeThread("worker")
    thread.stop()
    with pytest.raises(ThreadStopped, match="'worker' has not been started"):
        thread.call(Endless().wait())
    thread.start().stop()
    thread.stop()
    with pytest.raises(ThreadStopped, match="'worker' has been stopped"):
        thread.submit(Endless().wait())
    with pytest.raises(RuntimeError, match="once"):
        thread.start()


def test_waiting_in_the_loops_own_thread_is_an_error() -> None:
    """A method that would wait for its own thread raises RuntimeError."""
    with NodeThread("worker") as thread:
        for wait in (lambda: thread.call(Endless().wait()), thread.stop):
            with pytest.raises(RuntimeError, match="in the thread 'worker' would wait for itself"):
                thread.call(wait)
        assert thread.call(lambda: thread.submit(lambda: 7)).result(DEADLINE_SEC) == 7


def test_a_node_without_a_broker_is_the_callers_error(host: Host) -> None:
    """BrokerUnreachable is raised where the node is entered; the thread works on."""
    lost = host.node("lost", url="callboard://127.0.0.1:1", connect_timeout_sec=0.05)
    with pytest.raises(actors.BrokerUnreachable):
        host.thread.enter(lost)
    assert host.thread.enter(host.node("found")).connected


def test_what_is_entered_too_late_is_left(monkeypatch: pytest.MonkeyPatch) -> None:
    """`enter` cancels it, and `stop` waits for its end, before it leaves what was entered earlier."""
    set_limits(monkeypatch, thread_grace_sec=0)
    started, left = threading.Event(), list[str]()

    @asynccontextmanager
    async def early() -> AsyncGenerator[None]:
        yield
        left.append("early")

    @asynccontextmanager
    async def late() -> AsyncGenerator[None]:
        started.set()
        try:
            await asyncio.Event().wait()
            yield
        finally:
            await asyncio.sleep(0.1)
            left.append("late")

    with NodeThread() as thread:
        thread.enter(early())
        while not started.is_set():  # the time may be over before it begins
            with pytest.raises(actors.WaitTimeout):
                thread.enter(late(), timeout_sec=0.01)
    assert left == ["late", "early"]


@pytest.mark.parametrize("turns", range(5))
def test_what_is_entered_as_the_time_ends_is_left(turns: int) -> None:
    """Wherever the loop is at that moment: also if it has been entered, but the caller has not got it."""
    expired, left = threading.Event(), threading.Event()

    def block_after(turns: int) -> None:
        if turns:
            asyncio.get_running_loop().call_soon(block_after, turns - 1)
        else:
            expired.wait(DEADLINE_SEC)

    @asynccontextmanager
    async def context() -> AsyncGenerator[None]:
        asyncio.get_running_loop().call_soon(block_after, turns)
        try:
            yield
        finally:
            left.set()

    with NodeThread() as thread:
        try:
            thread.enter(context(), timeout_sec=0.1)
        except actors.WaitTimeout:
            expired.set()
            assert left.wait(DEADLINE_SEC)
        finally:
            expired.set()


def enter_failing_node(thread: NodeThread, host: Host) -> None:
    """Enter a node that then fails."""
    node = thread.enter(host.node("failing", on_error="stop"))

    def fail() -> None:
        raise ValueError("the node is broken")

    thread.submit(lambda: node.create_timer(0, fail))


def test_a_failing_node_ends_the_thread(host: Host) -> None:
    """Others are left, calls raise with the cause, and so does the end of `with`."""
    endless = Endless()

    def program() -> None:
        with NodeThread("worker") as thread:
            other = thread.enter(host.node("other"))
            enter_failing_node(thread, host)
            with pytest.raises(ThreadStopped, match="'worker' has ended: ValueError: the no") as caught:
                thread.call(endless.wait)
            assert isinstance(caught.value.__cause__, ValueError)
            assert thread.ended.exception(DEADLINE_SEC) is caught.value.__cause__
            assert not other.connected
            thread.call(lambda: None)

    with pytest.raises(ValueError, match="the node is broken"):
        program()


def test_an_error_of_the_body_is_not_hidden(host: Host) -> None:
    """The failure of a node does not replace it; `stop` raises the failure."""
    thread = NodeThread()

    def program() -> None:
        with thread:
            enter_failing_node(thread, host)
            thread.ended.exception(DEADLINE_SEC)
            raise LookupError

    with pytest.raises(LookupError):
        program()
    with pytest.raises(ValueError, match="the node is broken"):
        thread.stop()


def test_an_error_on_leaving_is_raised() -> None:
    """By `leave`; or by `stop`, after everything else is left."""
    left: list[str] = []

    @asynccontextmanager
    async def context(name: str) -> AsyncGenerator[str]:
        yield name
        left.append(name)
        if name == "broken":
            raise ValueError(name)

    thread, first = NodeThread().start(), context("broken")
    thread.enter(first)
    with pytest.raises(ValueError, match="broken"):
        thread.leave(first)
    thread.enter(context("whole"))
    thread.enter(context("broken"))
    with pytest.raises(ValueError, match="broken"):
        thread.stop()
    assert left == ["broken", "broken", "whole"]


def test_sys_exit_in_the_loop_ends_the_thread() -> None:
    """What was entered is left, calls end, and `stop` raises it."""
    left, endless = threading.Event(), Endless()

    @asynccontextmanager
    async def context() -> AsyncGenerator[None]:
        try:
            yield
        finally:
            left.set()

    thread = NodeThread().start()
    thread.enter(context())
    waiting = thread.submit(endless.wait())
    assert endless.running.wait(DEADLINE_SEC)
    thread.submit(lambda: asyncio.get_running_loop().call_soon(sys.exit, 3))
    assert isinstance(thread.ended.exception(DEADLINE_SEC), SystemExit)
    with pytest.raises(ThreadStopped, match="has ended: SystemExit: 3"):
        waiting.result(DEADLINE_SEC)
    with pytest.raises(ThreadStopped, match="has ended: SystemExit: 3"):
        thread.call(lambda: None)
    assert left.is_set()
    with pytest.raises(SystemExit):
        thread.stop()


def test_sys_exit_in_a_call_reaches_the_caller() -> None:
    """SystemExit in a call is raised in the calling thread and ends the loop's thread."""
    thread = NodeThread().start()
    with pytest.raises(SystemExit):
        thread.call(raises(SystemExit(4)))
    with pytest.raises(SystemExit):
        thread.stop()


def test_a_loop_that_cannot_be_made_is_an_error() -> None:
    """`start` raises it."""

    def factory() -> Any:
        raise OSError("too many open files")

    thread = NodeThread(loop_factory=factory)
    with pytest.raises(OSError, match="too many"):
        thread.start()
    thread.stop()


FORGETFUL = """
import asyncio, sys
from contextlib import asynccontextmanager
from actors.threads import NodeThread

@asynccontextmanager
async def context():
    await asyncio.to_thread(int)  # the loop has an executor
    yield
    await asyncio.sleep(0.01)
    print("left")

thread = NodeThread().start()
thread.enter(context())
"""


@pytest.mark.processes
def test_a_forgotten_thread_is_stopped_when_the_program_ends() -> None:
    """What was entered is left, and the process exits."""
    done = subprocess.run(
        [sys.executable, "-c", FORGETFUL], capture_output=True, text=True, check=False, timeout=DEADLINE_SEC
    )
    assert (done.stdout, done.stderr, done.returncode) == ("left\n", "", 0)


FORKED = """
import os, sys, warnings
from actors.threads import NodeThread, ThreadStopped, TooManyCalls
warnings.simplefilter("ignore")

with NodeThread() as thread:
    child = os.fork()
    if child == 0:
        try:
            thread.call(lambda: None)
        except ThreadStopped as error:
            print(error, flush=True)
        thread.stop()
        with NodeThread() as own:
            print(own.call(lambda: "works"), flush=True)
        sys.exit(5)
    print(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]), thread.call(lambda: "goes on"))
"""


@pytest.mark.skipif(not hasattr(os, "fork"), reason="needs fork")
@pytest.mark.processes
def test_a_forked_child_has_no_thread() -> None:
    """Calls raise there instead of waiting for ever; it may have a thread of its own."""
    done = subprocess.run(
        [sys.executable, "-c", FORKED], capture_output=True, text=True, check=False, timeout=DEADLINE_SEC
    )
    refusal = "The thread 'callboard-nodes' runs in the parent process: start one after the fork"
    assert (done.stdout, done.stderr) == (f"{refusal}\nworks\n5 goes on\n", "")


def test_functions_are_posted_in_order(host: Host) -> None:
    """They run in the loop, those posted before a call before it; a stopped thread takes none."""
    seen = list[int]()
    with NodeThread("posts") as thread:
        for number in range(100):
            thread.post(seen.append, number)
        assert thread.call(lambda: len(seen)) == 100
    assert seen == list(range(100))
    with pytest.raises(ThreadStopped):
        thread.post(seen.append, 0)


class InterruptedLoop(asyncio.SelectorEventLoop):
    """A loop whose callers are interrupted as they post: `interrupt` is called once."""

    interrupt: Callable[[], object] | None = None

    def call_soon_threadsafe(self, *args: Any, **kwargs: Any) -> asyncio.Handle:  # type: ignore[override]
        """Post a callback."""
        interrupt, self.interrupt = self.interrupt, None
        if interrupt is not None:
            interrupt()
        return super().call_soon_threadsafe(*args, **kwargs)


def test_a_signal_handler_that_interrupts_a_post_may_post() -> None:
    """And stop the thread: then the interrupted one raises ThreadStopped."""
    loop, posted = InterruptedLoop(), Queue[str]()
    with NodeThread(loop_factory=lambda: loop) as thread:

        def post() -> None:
            loop.interrupt = lambda: thread.post(posted.put, "handler")
            thread.post(posted.put, "interrupted")
            loop.interrupt = thread.stop
            try:
                thread.post(posted.put, "late")
            except ThreadStopped:
                posted.put("stopped")

        threading.Thread(target=post, daemon=True).start()
        assert [posted.get(timeout=DEADLINE_SEC) for _ in range(3)] == ["handler", "interrupted", "stopped"]
