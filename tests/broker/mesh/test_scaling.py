"""The model of docs/mesh.md §6 (how a mesh grows) against brokers that are simulated."""

from __future__ import annotations

from pathlib import Path

import pytest

from broker.mesh import wire
from broker.mesh.messages import Change, Heartbeat, Message
from broker.routing.records import NodeRecord
from tests.broker import frame_makers as make
from tests.broker.mesh.network import MeshBroker, Network

DOCUMENT = Path(__file__).parents[3] / "docs" / "mesh.md"

ENDPOINTS = 10
"""Of each node."""

HEARTBEAT_ENTRY_BYTES = 20
CHANGE_BYTES = range(20, 251)
HASH = "RIHS01_" + "a" * 64


class CountingNetwork(Network):
    """A network that keeps what its brokers send.

    Attributes:
        sent: By broker, its messages.
    """

    def __init__(self, count: int) -> None:
        self.sent: dict[int, list[Message]] = {number: [] for number in range(1, count + 1)}
        super().__init__(count)

    def carry(self, sender: MeshBroker, message: Message) -> None:
        """Keep a message and carry it."""
        self.sent[sender.number].append(message)
        super().carry(sender, message)

    def of_type(self, kind: type[Message]) -> dict[int, list[Message]]:
        """Return the messages of a kind, by broker, since the last call of `clear`."""
        return {
            number: [each for each in sent if isinstance(each, kind)] for number, sent in self.sent.items()
        }

    def clear(self) -> None:
        """Forget what was sent."""
        for sent in self.sent.values():
            sent.clear()


def add_nodes(network: Network, nodes: int) -> None:
    """Let every broker have so many nodes, each with `ENDPOINTS` endpoints on topics of its own."""
    for broker in network:
        for number in range(nodes):
            name = f"/fleet/robot{broker.number}/node{number}"
            peer = broker.join(name)
            broker.send(
                peer,
                *(
                    make.publisher(each, f"{name}/topic{each}", type_hash=HASH)
                    for each in range(1, ENDPOINTS + 1)
                ),
            )
    network.settle()


@pytest.mark.parametrize(("brokers", "nodes"), [(2, 1), (3, 8), (6, 5), (12, 2), (25, 1)])
def test_a_mesh_grows_as_the_model_says(brokers: int, nodes: int) -> None:
    """Mirrored endpoints, heartbeats and their size, changes and their size, subscriptions."""
    network = CountingNetwork(brokers)
    network.clear()
    add_nodes(network, nodes)
    changes = network.of_type(Change)
    for broker in network:
        mirrored = [each for each in broker.router.graph.endpoints() if each.broker != broker.number]
        assert len(mirrored) == (brokers - 1) * nodes * (1 + ENDPOINTS)
        assert sum(isinstance(each, NodeRecord) for each in mirrored) == (brokers - 1) * nodes
        received = [change for number, sent in changes.items() if number != broker.number for change in sent]
        assert len(received) == (brokers - 1) * nodes * (1 + ENDPOINTS)
        for change in received:
            assert isinstance(change, Change)
            assert len(wire.encode_change(change)[0]) in CHANGE_BYTES
    network.clear()
    network.beat()
    beats = network.of_type(Heartbeat)
    for number in network.brokers:
        heard = [beat for other, sent in beats.items() if other != number for beat in sent]
        assert len(heard) == brokers - 1
        size = sum(len(wire.encode_heartbeat(beat)) for beat in heard if isinstance(beat, Heartbeat))
        assert size <= HEARTBEAT_ENTRY_BYTES * (brokers - 1) ** 2 + 20 * (brokers - 1)


def test_the_document_has_the_model_that_is_tested() -> None:
    """Its formulas and numbers."""
    section = DOCUMENT.read_text(encoding="utf-8").partition("## 6 How it grows")[2]
    for text in (
        "`(B - 1) * N * (1 + E)`",
        f"at most {HEARTBEAT_ENTRY_BYTES} bytes",
        f"`{HEARTBEAT_ENTRY_BYTES} * (B - 1)^2`",
        f"one change of {CHANGE_BYTES[0]} to {CHANGE_BYTES[-1]} bytes",
    ):
        assert text in section
