"""Tools for tests of nodes: whole launches, a proxy that breaks connections on demand, and pytest fixtures.

The fixtures come with the package: pytest finds them by itself (`actors/testing/plugin.py`).

Imports launch, processes, node and the packages below them, and broker.
"""

from __future__ import annotations

from actors.lazy import lazy_imports

with lazy_imports(__name__):
    from actors.testing.fault_proxy import FaultProxy as FaultProxy
    from actors.testing.fault_proxy import ProxiedConnection as ProxiedConnection
    from actors.testing.launch_run import LaunchWaitError as LaunchWaitError
    from actors.testing.launching import RunningLaunch as RunningLaunch
    from actors.testing.launching import launch as launch
    from actors.testing.link_faults import Direction as Direction
    from actors.testing.plugin import NodeFactory as NodeFactory
    from actors.testing.simulated_clock import SimulatedClock as SimulatedClock
    from actors.testing.transcript import OutputLine as OutputLine
    from actors.testing.transcript import ProcessState as ProcessState
    from actors.testing.transcript import ProcessStatus as ProcessStatus
