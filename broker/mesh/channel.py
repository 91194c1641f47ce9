"""What the router sends to the mesh: an outbox whose frames become messages to other brokers."""

from __future__ import annotations

from typing import TYPE_CHECKING

from proto import frames
from proto.codec import Decoder, encode
from proto.fragments import Reassembler
from proto.outbox import Outbox

if TYPE_CHECKING:
    from broker.mesh.engine import Engine
    from broker.mesh.mesh import Mesh
    from proto.errors import ProtocolError
    from proto.frames import Frame


class MeshChannel:
    """The outbox of one graph's mesh (`deliveries.Recipient`).

    Args:
        mesh: Turns frames into messages.
        engine: Sends them.
        domain: The graph's number.

    Attributes:
        mesh: As given.
        outbox: What waits.
    """

    def __init__(self, mesh: Mesh, engine: Engine, domain: int) -> None:
        self.mesh = mesh
        self.outbox = Outbox()
        self._engine = engine
        self._domain = domain
        self._decoder = Decoder()
        self._reassembler = Reassembler()

    @property
    def has_unsent(self) -> bool:
        """Whether anything waits for the engine."""
        outbox = self.outbox
        return outbox.urgent_bytes > 0 or outbox.ordered_bytes > 0 or outbox.has_more

    def send(self, frame: Frame) -> None:
        """Queue a control frame."""
        self.outbox.put_control(encode(frame))

    def fail(self, error: ProtocolError) -> None:
        """Ignore an error that would close a node's link: the mesh stays."""
        del error

    def flush(self) -> None:
        """Send what waits until the engine is full, then trim the publisher queues."""
        outbox, engine = self.outbox, self._engine
        while not engine.full:
            parts, _ = outbox.take(1)
            if not parts:
                break
            raw = parts[0] if len(parts) == 1 else b"".join(parts)
            frame = self._decoder.decode(raw)
            if isinstance(frame, frames.Abort):
                self._reassembler.abort(frame)
                continue
            if isinstance(frame, frames.Fragment):
                whole = self._reassembler.add(frame)
                if whole is None:
                    continue
                frame = self._decoder.decode(whole)
            self.mesh.sender.send(frame)
            self._pass_on()
        outbox.trim()
        self.mesh.wanted.update()
        self._pass_on()

    def _pass_on(self) -> None:
        if messages := self.mesh.take():
            self._engine.send(self._domain, messages)
