"""A broker that gets messages of two other brokers, which a test makes."""

from __future__ import annotations

from typing import Any

from broker.mesh.messages import Change, Direct, Snapshot
from proto.wire import frames
from proto.wire.identity import VERSION
from tests.broker import frame_makers as make
from tests.broker.mesh.network import MeshBroker
from tests.seams.brokers import endpoint_keys
from tests.seams.structure import of_router

HERE, THERE, OTHER = 1, 2, 3
NODE = frames.Node(1, "/remote")


class Attack:
    """A broker whose peers are two nodes of its own and two other brokers, whose messages a test makes.

    Broker 2 has the node 1, the publisher 2, the subscription 3 and the client 4; broker 3 has a server.

    Attributes:
        broker: The broker under attack.
        mesh: Its mesh.
        node: The peer of its node, which has a publisher, a subscription, a server and a client.
        publisher: The key of the publisher.
        warnings: What it has logged.
    """

    def __init__(self, **limits: int) -> None:
        self.broker = MeshBroker(HERE, **limits)
        self.mesh = self.broker.mesh
        self.warnings = self.broker.warnings
        self.node = self.broker.join("/local")
        self.broker.send(self.node, make.subscription(2), make.service(3), make.client(4, "/other"))
        self.publisher = self.broker.publisher(self.node, make.publisher(1))
        self.calls = 100
        self.number = dict.fromkeys((THERE, OTHER), 0)
        self.version = dict.fromkeys((THERE, OTHER), 0)
        for broker in (THERE, OTHER):
            self.mesh.add_broker(broker)
            self.mesh.snapshot(broker, 1)
            self.mesh.accept_snapshot(broker, Snapshot(1, 0, ()))
        self.change(NODE, make.publisher(2, node=1), make.subscription(3, node=1), make.client(4, node=1))
        self.change(frames.Node(1, "/third"), make.service(2, "/other", node=1), broker=OTHER)
        self.direct(self.attached())
        self.settle()

    def rejoin(self, *declarations: frames.Frame) -> None:
        """Answer the request for a snapshot of broker 2, which has come back."""
        self.version[THERE], self.number[THERE] = 10, 0
        self.mesh.snapshot(THERE, 2)
        self.mesh.accept_snapshot(THERE, Snapshot(2, 10, declarations))

    def change(self, *changed: Any, broker: int = THERE) -> None:
        """Send changes with their right versions."""
        for frame in changed:
            self.version[broker] += 1
            self.mesh.receive(broker, Change(self.version[broker], frame))

    def direct(self, frame: Any, endpoint: int = 0, *, broker: int = THERE) -> None:
        """Send a direct message with its right number."""
        self.number[broker] += 1
        self.mesh.receive(broker, Direct(HERE, 1, self.number[broker], endpoint, frame))

    def attached(self, number: int = 2, reader: int = 2, *, broker: int = THERE) -> frames.Attached:
        """Return ATTACHED of a publisher, for the subscription with a number."""
        return frames.Attached(broker << 32 | number, (reader,), make.GID, 0, "/remote", {})

    def number_of(self, endpoint: int) -> int:
        """Return by which number other brokers know an endpoint of the local node."""
        record = self.broker.router.endpoint(self.node, endpoint)
        assert record is not None
        return record.number

    def settle(self) -> list[Any]:
        """Let the broker do what there is to do, and return its messages."""
        self.broker.forward()
        return self.mesh.pop_messages()

    def sent(self) -> list[tuple[Any, int]]:
        """Return the frames that it has sent to one broker, and the broker's number."""
        return [(each.frame, each.broker) for each in self.settle() if isinstance(each, Direct)]

    def assert_rejected(self) -> None:
        """Broker 2 has left no trace, the reason is logged, and the others work as before."""
        assert [broker for what, broker, _ in self.warnings if what == "rejected"] == [THERE]
        assert self.mesh.rejected == 1
        assert tuple(self.mesh.sessions.names()) == (OTHER,)
        assert self.mesh.snapshot(THERE, 1) == Snapshot(0, 0, (), f"broker{HERE}", VERSION)
        keys = {key >> 32 for key in endpoint_keys(self.broker.router)}
        assert keys == {HERE, OTHER}
        self.settle()
        self.calls += 1
        self.broker.send(self.node, make.request(4, self.calls))
        assert [broker for _, broker in self.sent()] == [OTHER]
        assert list(of_router(self.broker.router)) == []
