"""rclpy's functions: programs import this package as `rclpy`.

Imports what `actors.ros` may, and nothing of `launch`.
"""

from __future__ import annotations

import importlib
from contextlib import contextmanager
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any, Self

from actors.ros.rclpy.context import Context as Context
from actors.ros.rclpy.parameter import Parameter as Parameter
from actors.ros.rclpy.signals import (
    SignalHandlerOptions,
    install_signal_handlers,
    uninstall_signal_handlers,
)
from actors.ros.rclpy.task import Future as Future
from actors.ros.rclpy.utilities import get_default_context
from actors.ros.rclpy.utilities import (
    get_rmw_implementation_identifier as get_rmw_implementation_identifier,
)
from actors.ros.rclpy.utilities import ok as ok
from actors.ros.rclpy.utilities import shutdown as _shutdown
from actors.ros.rclpy.utilities import try_shutdown as _try_shutdown

if TYPE_CHECKING:
    from collections.abc import Generator, Sequence
    from types import TracebackType

    from actors.ros.rclpy.executors import Executor
    from actors.ros.rclpy.node import Node


def __getattr__(name: str) -> Any:
    """Load a module that a program uses without importing it, such as `rclpy.logging`."""
    # Looked for before it is imported, so that an error inside the module is not taken for a missing one.
    if name.startswith("_") or find_spec(f"{__name__}.{name}") is None:
        raise AttributeError(f"module 'rclpy' has no attribute '{name}'")
    return importlib.import_module(f"{__name__}.{name}")


class InitContextManager:
    """Returned by `init`: shuts the context down at the end of a `with` block."""

    def __init__(
        self,
        args: Sequence[str] | None,
        context: Context | None,
        domain_id: int | None,
        signal_handler_options: SignalHandlerOptions | None,
    ) -> None:
        self.context = context or get_default_context()
        if signal_handler_options is None:
            # As in rclpy: a context of its own is often part of a program that handles signals itself.
            default = self.context is get_default_context()
            signal_handler_options = SignalHandlerOptions.ALL if default else SignalHandlerOptions.NO
        self.installed_signal_handlers = signal_handler_options is not SignalHandlerOptions.NO
        self.context.init(args, domain_id=domain_id)
        install_signal_handlers(signal_handler_options)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        exc_type: type[BaseException] | None,
        exc_val: BaseException | None,
        exc_tb: TracebackType | None,
    ) -> None:
        # None lets `try_shutdown` replace the default context; given by name, it would stay, and could not
        # be used again.
        context = None if self.context is get_default_context() else self.context
        try_shutdown(context=context, uninstall_handlers=self.installed_signal_handlers)


def init(
    *,
    args: Sequence[str] | None = None,
    context: Context | None = None,
    domain_id: int | None = None,
    signal_handler_options: SignalHandlerOptions | None = None,
) -> InitContextManager:
    """Make nodes possible.

    Args:
        args: Command-line arguments; None: those of the process.
        context: The context; None for the default one.
        domain_id: The domain of the nodes; None for the environment's.
        signal_handler_options: Which signals end the context; None: both for the default context, else none.

    Returns:
        A context manager that shuts down at its end.

    Raises:
        RuntimeError: The context has been initialized before.
    """
    return InitContextManager(args, context, domain_id, signal_handler_options)


_executor: Executor | None = None


def get_global_executor() -> Executor:
    """Return the executor of `spin`; made on first use, and again after a shutdown."""
    global _executor  # noqa: PLW0603 - rclpy's
    # The default context has been replaced by a shutdown; an executor is tied to one context for good.
    if _executor is None or _executor.context is not get_default_context():
        from actors.ros.rclpy.executors import SingleThreadedExecutor  # noqa: PLC0415 - programs may have their own

        _executor = SingleThreadedExecutor()
        _executor.is_global = True
        get_default_context().on_shutdown(_forget_global_executor)
    return _executor


def _forget_global_executor() -> None:
    global _executor
    executor, _executor = _executor, None
    if executor is not None:
        executor.shutdown()


def shutdown(*, context: Context | None = None, uninstall_handlers: bool | None = None) -> None:
    """Shut a context down.

    Args:
        context: The context; None for the default one.
        uninstall_handlers: Whether to restore the signal handlers; None: for the default context only.

    Raises:
        RuntimeError: It is not initialized, or has been shut down before.
    """
    default = context is None or context is get_default_context()
    _shutdown(context=context)
    if uninstall_handlers or (uninstall_handlers is None and default):
        uninstall_signal_handlers()


def try_shutdown(*, context: Context | None = None, uninstall_handlers: bool | None = None) -> None:
    """Shut a context down unless that has been done; arguments as for `shutdown`."""
    default = context is None or context is get_default_context()
    _try_shutdown(context=context)
    if uninstall_handlers or (uninstall_handlers is None and default):
        uninstall_signal_handlers()


def create_node(node_name: str, **options: Any) -> Node:
    """Make a node; the options are those of `rclpy.node.Node`."""
    from actors.ros.rclpy.node import Node  # noqa: PLC0415 - lets `import rclpy` be quick

    return Node(node_name, **options)


def spin_once(node: Node, *, executor: Executor | None = None, timeout_sec: float | None = None) -> None:
    """Wait for one callback of a node, or of the executor's others, and run it."""
    with _executor_of(node, executor) as chosen:
        chosen.spin_once(timeout_sec=timeout_sec)


def spin(node: Node, executor: Executor | None = None) -> None:
    """Run a node's callbacks until the context is shut down.

    Raises:
        ExternalShutdownException: It was shut down while this waited, as by SIGTERM.
    """
    with _executor_of(node, executor) as chosen:
        chosen.spin()


def spin_until_future_complete(
    node: Node, future: Future[Any], executor: Executor | None = None, timeout_sec: float | None = None
) -> None:
    """Run a node's callbacks until a future is done, or the time is over."""
    with _executor_of(node, executor) as chosen:
        chosen.spin_until_future_complete(future, timeout_sec)


@contextmanager
def _executor_of(node: Node, executor: Executor | None) -> Generator[Executor]:
    """Add a node to an executor, or the global one, within a `with` block."""
    if executor is None:
        node.context.ok()  # raises that the process was forked after the node was made
        executor = get_global_executor()
    added = executor.add_node(node)
    try:
        yield executor
    finally:
        # A node that was there before stays: the caller did not ask for its removal.
        if added:
            executor.remove_node(node)
