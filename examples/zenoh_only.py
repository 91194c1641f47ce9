"""Take part in a mesh of brokers with Zenoh alone: hear `/addison`, and serve `add_two_ints`.

Beside it run `callboard broker --mesh-listen tcp/127.0.0.1:7447`, `python examples/minimal_publisher.py` and
`python examples/add_two_ints_client.py 5 3`. To the brokers this program is one of them, with one node;
docs/mesh.md has the keys, docs/protocol.md the frames.
"""

# pyright: reportUnknownMemberType=false

import json
import secrets
import struct
import sys
import threading
from contextlib import suppress
from typing import Any

import msgpack
import zenoh

NODE, SUBSCRIPTION, SERVICE, REQUEST, REPLY = 10, 12, 13, 40, 41
ADD_TWO_INTS = "RIHS01_e118de6bf5eeb66a2491b5bda11202e7b68f198d6f67922cf30364858239c81a"

PREFIX = "callboard/1/0"  # version 1 of the mesh, domain 0
NUMBER = 1 + secrets.randbelow(2**31 - 1)
ID = f"{NUMBER:08x}"


def frame(*fields: Any) -> bytes:
    """Return a frame: a msgpack bin 32 with an array inside."""
    header = msgpack.packb(fields)
    return b"\xc6" + struct.pack(">I", len(header)) + header


DECLARATIONS = [
    frame(NODE, 1, "/zenoh_only"),
    frame(SUBSCRIPTION, 2, 1, "/addison", None, None, {"depth": 10}, 0, 0),
    frame(SERVICE, 3, 1, "/add_two_ints", "example_interfaces/srv/AddTwoInts", ADD_TWO_INTS, None),
]


class Participant:
    """A session, and what it has sent to each broker."""

    def __init__(self, session: zenoh.Session) -> None:
        self.session = session
        self.source = zenoh.SourceInfo(session.id, 0)
        self.epochs: dict[int, int] = {}
        self.sent: dict[int, int] = {}
        mine = f"{PREFIX}/brokers/{ID}"
        self.declared = [
            session.declare_queryable(f"{mine}/graph", self.on_query),
            session.declare_subscriber(f"{mine}/frames/*", self.on_frame),
            session.declare_subscriber(f"{PREFIX}/topics/addison", self.on_batch),
            session.liveliness().declare_token(f"{PREFIX}/alive/{ID}"),  # last: now others ask for the graph
        ]

    def begin(self, broker: int, epoch: int) -> None:
        """Count direct messages from 1 again if this is a new epoch."""
        if epoch > self.epochs.get(broker, 0):
            self.epochs[broker], self.sent[broker] = epoch, 0

    def on_query(self, query: zenoh.Query) -> None:
        """Answer a broker that asks for the snapshot."""
        broker, epoch = struct.unpack(">QQ", query.payload.to_bytes()) if query.payload else (0, 0)
        self.begin(broker, epoch)
        snapshot = {"epoch": epoch, "version": 3, "declarations": DECLARATIONS, "name": "zenoh_only"}
        snapshot["sourced"] = True  # all samples name their source
        query.reply(query.key_expr, msgpack.packb(snapshot))

    def on_batch(self, sample: zenoh.Sample) -> None:
        """Print the messages of a BATCH: its payload is an array of maps."""
        unpacker = msgpack.Unpacker()
        unpacker.feed(sample.payload.to_bytes()[5:])
        unpacker.unpack()  # the header
        for message in unpacker.unpack():
            print(f"I heard: {message['data']}", flush=True)

    def on_frame(self, sample: zenoh.Sample) -> None:
        """Answer the calls in a REQUEST."""
        broker = int(str(sample.key_expr).rpartition("/")[2], 16)
        assert sample.attachment is not None
        epoch, _, _ = struct.unpack(">QQQ", sample.attachment.to_bytes())
        self.begin(broker, epoch)
        kind, client, *fields = msgpack.unpackb(sample.payload.to_bytes()[5:])
        if kind == REQUEST:
            calls = [(call, msgpack.unpackb(body)) for call, _, _, body in fields[0]]
            replies = [
                (call, 0, False, None, msgpack.packb({"sum": body["a"] + body["b"]})) for call, body in calls
            ]
            self.sent[broker] += 1
            self.session.put(
                f"{PREFIX}/brokers/{broker:08x}/frames/{ID}",
                frame(REPLY, client, replies),
                attachment=struct.pack(">QQQ", epoch, self.sent[broker], 0),
                source_info=self.source,
            )


def main() -> None:
    """Take part until Ctrl-C."""
    config = zenoh.Config()
    config.insert_json5("mode", '"client"')
    config.insert_json5("id", f'"{NUMBER:x}"')  # brokers take answers from this session only
    config.insert_json5("connect/endpoints", json.dumps(sys.argv[1:] or ["tcp/127.0.0.1:7447"]))
    with zenoh.open(config) as session, suppress(KeyboardInterrupt):
        participant = Participant(session)
        print(f"Broker {ID}, with {len(participant.declared)} keys", flush=True)
        threading.Event().wait()


if __name__ == "__main__":
    main()
