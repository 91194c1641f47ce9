"""Tools for tests of nodes: a proxy that breaks connections on demand, and pytest fixtures.

The fixtures come with the package: pytest finds them by itself (`actors/testing/plugin.py`).
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from actors.testing.fault_proxy import FaultProxy as FaultProxy
    from actors.testing.fault_proxy import ProxiedConnection as ProxiedConnection
    from actors.testing.plugin import NodeFactory as NodeFactory
    from actors.testing.weather import Direction as Direction

_HOME_OF = {
    "Direction": "actors.testing.weather",
    "FaultProxy": "actors.testing.fault_proxy",
    "NodeFactory": "actors.testing.plugin",
    "ProxiedConnection": "actors.testing.fault_proxy",
}


def __getattr__(name: str) -> object:
    if name not in _HOME_OF:
        raise AttributeError(f"module 'actors.testing' has no attribute '{name}'")
    value = getattr(import_module(_HOME_OF[name]), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *_HOME_OF})
