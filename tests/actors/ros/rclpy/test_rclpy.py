"""The functions of the package: contexts from `init` to `shutdown`, signals, and spinning."""

from __future__ import annotations

import signal
import threading
from typing import TYPE_CHECKING

import pytest

from actors.logging.severity import LoggingSeverity
from actors.ros import rclpy
from actors.ros.rclpy import context as context_module
from actors.ros.rclpy import logging, signals, utilities
from actors.ros.rclpy._rclpy_pybind11 import RCLError
from actors.ros.rclpy.context import Context
from actors.ros.rclpy.executors import MultiThreadedExecutor, TimeoutObject
from actors.ros.rclpy.signals import SignalHandlerOptions

if TYPE_CHECKING:
    from collections.abc import Iterator

DEADLINE_SEC = 20.0


@pytest.fixture(autouse=True)
def _default_context(context: Context, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """The broker of `context`; the log of the tests' process stays as it is, and the default context ends."""
    monkeypatch.setattr(context_module, "set_up_logging", lambda arguments: None)
    yield
    rclpy.try_shutdown()
    assert signals.get_current_signal_handlers_options() is SignalHandlerOptions.NO


def test_a_program_from_init_to_shutdown() -> None:
    """Each spin of the package runs the callbacks; wrong order is an error."""
    assert not rclpy.ok()
    with pytest.raises(RuntimeError, match="must be initialized"):
        rclpy.shutdown()
    rclpy.init(args=["program"])
    with pytest.raises(RuntimeError, match="only be called once"):
        rclpy.init(args=[])
    node = rclpy.create_node("node")
    ticks, future = list[int](), rclpy.Future[None](executor=rclpy.get_global_executor())
    timer = node.create_timer(0.001, lambda: ticks.append(1))
    rclpy.spin_once(node, timeout_sec=DEADLINE_SEC)
    assert ticks == [1]
    node.create_timer(0.002, lambda: future.set_result(None))
    rclpy.spin_until_future_complete(node, future, timeout_sec=DEADLINE_SEC)
    assert future.done()
    timer.cancel()
    node.create_timer(0.001, rclpy.shutdown)
    rclpy.spin(node)
    assert not rclpy.ok()
    assert rclpy.get_rmw_implementation_identifier() in utilities.get_available_rmw_implementations()


def test_a_with_block_shuts_down() -> None:
    """Also a context of its own, which has no signal handlers."""
    with rclpy.init(args=[], domain_id=3) as made:
        assert rclpy.ok()
        assert made.context.get_domain_id() == 3
        assert signals.get_current_signal_handlers_options() is SignalHandlerOptions.ALL
    assert not rclpy.ok()
    own = Context()
    with pytest.raises(RuntimeError, match="lower than zero"):
        own.init([], domain_id=-1)
    with rclpy.init(args=[], context=own):
        assert signals.get_current_signal_handlers_options() is SignalHandlerOptions.NO
    with pytest.raises(RCLError, match="already been shut down"):
        own.shutdown()
    own.destroy()
    seen = list[int]()
    own.on_shutdown(lambda: seen.append(1))
    assert seen == [1]


def test_a_signal_ends_the_contexts() -> None:
    """All of them; SIGINT raises KeyboardInterrupt as before, SIGTERM does nothing else."""
    for number in (signal.SIGTERM, signal.SIGINT):
        rclpy.init(args=[])
        other = Context()
        other.init([], initialize_logging=False)
        if number == signal.SIGINT:
            with pytest.raises(KeyboardInterrupt):
                signal.raise_signal(number)
        else:
            signal.raise_signal(number)
        assert not rclpy.ok()
        assert not other.ok()
        other.shutdown()
        rclpy.shutdown()
    assert signal.getsignal(signal.SIGTERM) is signal.SIG_DFL


def test_a_thread_leaves_signals_alone() -> None:
    """Python lets only the main thread handle them."""
    thread = threading.Thread(target=lambda: rclpy.init(args=[]))
    thread.start()
    thread.join(DEADLINE_SEC)
    assert rclpy.ok()
    assert signals.get_current_signal_handlers_options() is SignalHandlerOptions.NO


def test_an_executor_may_be_given(context: Context) -> None:
    """One that is warned about: a pool with a single thread."""
    node, seen = rclpy.create_node("node", context=context), list[int]()
    with pytest.warns(UserWarning, match="SingleThreadedExecutor instead"):
        executor = MultiThreadedExecutor(1, context=context)
    with executor:
        node.create_guard_condition(lambda: seen.append(1)).trigger()
        rclpy.spin_once(node, executor=executor, timeout_sec=DEADLINE_SEC)
        executor.spin_once_until_future_complete(rclpy.Future[None](), TimeoutObject(0.0))
        assert executor.shutdown(DEADLINE_SEC)
    assert seen == [1]


def test_helpers_are_rclpys() -> None:
    """Arguments without ROS's, seconds as nanoseconds, and the levels of loggers."""
    assert utilities.remove_ros_args(["p", "--ros-args", "-r", "a:=b", "--", "x"]) == ["p", "x"]
    assert [utilities.timeout_sec_to_nsec(each) for each in (None, -1, 1.5)] == [-1, -1, 1_500_000_000]
    logger = logging.get_logger("levels_of_rclpy")
    logging.set_logger_level(logger.name, LoggingSeverity.ERROR)
    assert logging.get_logger_effective_level(logger.name) is LoggingSeverity.ERROR
    assert logging.get_logging_severity_from_string("warn") is LoggingSeverity.WARN
