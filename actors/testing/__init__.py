"""Tools for tests of nodes: whole launches, a proxy that breaks connections on demand, and pytest fixtures.

The fixtures come with the package: pytest finds them by itself (`actors/testing/plugin.py`).
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from actors.testing.fault_proxy import FaultProxy as FaultProxy
    from actors.testing.fault_proxy import ProxiedConnection as ProxiedConnection
    from actors.testing.launching import LaunchWaitError as LaunchWaitError
    from actors.testing.launching import RunningLaunch as RunningLaunch
    from actors.testing.launching import launch as launch
    from actors.testing.plugin import NodeFactory as NodeFactory
    from actors.testing.transcript import OutputLine as OutputLine
    from actors.testing.transcript import ProcessState as ProcessState
    from actors.testing.transcript import ProcessStatus as ProcessStatus
    from actors.testing.weather import Direction as Direction

_HOME_OF = {
    "Direction": "actors.testing.weather",
    "FaultProxy": "actors.testing.fault_proxy",
    "LaunchWaitError": "actors.testing.launching",
    "NodeFactory": "actors.testing.plugin",
    "OutputLine": "actors.testing.transcript",
    "ProcessState": "actors.testing.transcript",
    "ProcessStatus": "actors.testing.transcript",
    "ProxiedConnection": "actors.testing.fault_proxy",
    "RunningLaunch": "actors.testing.launching",
    "launch": "actors.testing.launching",
}


def __getattr__(name: str) -> object:
    if name not in _HOME_OF:
        raise AttributeError(f"module 'actors.testing' has no attribute '{name}'")
    value = getattr(import_module(_HOME_OF[name]), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *_HOME_OF})
