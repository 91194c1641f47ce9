"""Deliberate breakages of the mesh, which the histories of a mesh must find."""

from __future__ import annotations

from contextlib import contextmanager
from typing import TYPE_CHECKING, Final
from unittest import mock

from broker.mesh.imports import MeshImports
from broker.mesh.receiver import MeshReceiver
from broker.mesh.sender import MeshSender
from broker.routing.mirrored import wants_latched
from tests.seams.simulation import set_version
from tests.simulation.breakages import does_nothing

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from contextlib import AbstractContextManager

    from broker.mesh.messages import Change
    from broker.routing.records import Route, SubscriptionRecord


@contextmanager
def ignores_versions() -> Iterator[None]:
    """A lost change is not noticed."""
    take = MeshImports.accept_change

    def take_any(imports: MeshImports, broker: int, change: Change) -> bool:
        set_version(imports, broker, change.version - 1)
        return take(imports, broker, change)

    with mock.patch.object(MeshImports, "accept_change", take_any):
        yield


@contextmanager
def replays_nothing() -> Iterator[None]:
    """Other brokers do not get what is latched."""

    def to_nodes_only(route: Route, subscription: SubscriptionRecord) -> bool:
        return not subscription.mirrored and wants_latched(route, subscription)

    with mock.patch("broker.routing.attachment_frames.wants_latched", to_nodes_only):
        yield


@contextmanager
def forgets_no_broker() -> Iterator[None]:
    """What brokers had that are gone stays."""
    with mock.patch.object(MeshImports, "remove_broker", _nothing_to_do):
        yield


def _nothing_to_do(_imports: MeshImports, _broker: int) -> Iterator[None]:
    return iter(())


BREAKAGES: Final[dict[str, tuple[Callable[[], AbstractContextManager[object]], bool]]] = {
    "lost changes are noticed": (ignores_versions, False),
    "other brokers get latched messages": (replays_nothing, True),
    "credit of other brokers' readers comes": (does_nothing(MeshReceiver, "_granted"), True),
    "publishers of other brokers are opened": (does_nothing(MeshReceiver, "_attached"), True),
    "replies come back": (does_nothing(MeshSender, "_send_reply"), True),
    "cancellations travel": (does_nothing(MeshSender, "_send_cancel"), True),
    "brokers that are gone are forgotten": (forgets_no_broker, False),
}
"""By promise: how to break it, and whether calm histories show it."""
