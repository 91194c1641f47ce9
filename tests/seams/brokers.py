"""What tests read or set inside a broker, its router, mesh and rules, where no public name has it."""

from __future__ import annotations

from types import SimpleNamespace
from typing import TYPE_CHECKING, cast

from broker.serving import connection

if TYPE_CHECKING:
    import pytest
    import zenoh

    from broker.access.admission import Admission
    from broker.access.rules import AccessRules, Rights
    from broker.mesh.engine.zenoh_engine import ZenohEngine
    from broker.mesh.imports import MeshImports
    from broker.mesh.mesh import Mesh
    from broker.routing.flow_control import CreditLimits
    from broker.routing.router import Router
    from broker.server import Broker
    from broker.serving.dispatcher import Dispatcher


def dispatcher_of(broker: Broker) -> Dispatcher:
    """Return the links and routers of a running broker: its users see their statistics only."""
    return broker._dispatcher


def endpoint_keys(router: Router) -> set[int]:
    """Return the keys of all endpoints that a router knows."""
    return {endpoint.key for endpoint in router.graph.endpoints()}


def suspended_keys(router: Router) -> set[int]:
    """Return the keys of the suspended endpoints in the graph; only watchers learn of them, as events."""
    return set(router.graph._suspended)


def latched_bytes(router: Router) -> int:
    """Return the size of a router's latched messages: the memory guard alone reads it."""
    return router._latched.bytes


def see_token(engine: ZenohEngine, key: str, kind: zenoh.SampleKind | None = None) -> None:
    """Let an engine see that a broker is there, or has gone, as a subscription of Zenoh tells it."""
    engine._on_token(0, cast("zenoh.Sample", SimpleNamespace(key_expr=key, kind=kind)))


def use_session(engine: ZenohEngine, session: object) -> None:
    """Give an engine a session of Zenoh that it has not opened."""
    engine._session = cast("zenoh.Session", session)


def imports_of(mesh: Mesh) -> MeshImports:
    """Return a mesh's table of other brokers' endpoints."""
    return mesh._imports


def remote_endpoints(mesh: Mesh) -> int:
    """Return how many endpoints of other brokers a mesh knows."""
    return len(mesh._imports._remotes)


def calls_between_brokers(mesh: Mesh) -> int:
    """Return how many calls to servers of other brokers a mesh remembers."""
    return len(mesh._calls)


def kept_failures(admission: Admission) -> int:
    """Return how many addresses with failed logins are kept: what an attacker could make grow."""
    return len(admission._failures)


def kept_addresses(admission: Admission) -> int:
    """Return how many addresses with connections are kept."""
    return len(admission._connections)


def kept_decisions(rights: Rights) -> int:
    """Return how many decisions are cached: a cache shows in no answer."""
    return len(rights._decisions)


def kept_rights(rules: AccessRules) -> int:
    """Return how many combinations of roles are cached."""
    return len(rules._rights)


def heap_length(limits: CreditLimits) -> int:
    """Return the length of a heap whose outdated entries are removed late."""
    return len(limits._sequences._heap)


def without_capabilities(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let brokers announce nothing that their first version did not have, as one that is older."""
    monkeypatch.setattr(connection, "Capability", ())
