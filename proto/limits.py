"""All limits of the wire protocol, with their reasons. Sizes are in bytes unless the name says otherwise.

docs/protocol.md specifies what happens at a limit: in most cases the connection that exceeds it gets an ERROR
frame that names the limit, and is closed.
"""

from __future__ import annotations

from typing import Final

PROTOCOL_VERSION: Final = 1
"""The version in HELLO and WELCOME; it changes only if an old peer could not take part any more."""

PREFIX_BYTES: Final = 5
"""A frame starts with msgpack's `bin 32` head: 0xc6 and a big-endian u32."""

MAX_FRAME_BYTES: Final = 256 * 1024
"""Content of one frame. Small enough that a large message never blocks a link for long."""

MAX_HELLO_BYTES: Final = 4 * 1024
"""Content of a frame before the session is open: an unknown peer gets no large buffer."""

MAX_TOKEN_CHARACTERS: Final = 512
"""The `auth` of a HELLO; a longer text is no token, and is not hashed."""

MAX_ADDRESS_CHARACTERS: Final = 45
"""The `client_address` of a HELLO: the longest text of an IPv6 address, whose end is written as IPv4."""

FRAGMENT_BYTES: Final = 128 * 1024
"""Payload of one FRAGMENT that we send: other publisher queues are served after each."""

MAX_MESSAGE_BYTES: Final = 64 * 1024 * 1024
"""A reassembled frame: one message, request or reply with its header."""

MAX_TRANSFERS: Final = 8
"""Open transfers on one link in one direction: bounds a receiver's memory for reassembly."""

BATCH_FLUSH_BYTES: Final = 48 * 1024
"""A batch is sent when its messages reach this size, without waiting for the end of the loop turn."""

BATCH_FLUSH_COUNT: Final = 4096
"""A batch is also sent at this many messages, which keeps its table of message ends far below a frame."""

MAX_QUEUE_BYTES: Final = 64 * 1024 * 1024
"""Messages waiting in one KEEP_LAST publisher queue, whatever its depth; beyond it the oldest are dropped."""

BATCH_OVERHEAD_BYTES: Final = 576
"""Estimated memory of a waiting or latched batch beside its messages (measured)."""

MESSAGE_OVERHEAD_BYTES: Final = 8
"""Estimated memory of each message in such a batch beside its bytes: two copies of its end."""

MAX_ATTRIBUTES_BYTES: Final = 4 * 1024
"""The encoded attributes of a batch or call, which nobody counts as messages."""

FRAME_OVERHEAD_BYTES: Final = 64
"""Estimated memory of any other waiting frame beside its bytes, which counts most for tiny ones."""

MAX_BATCH_COUNT: Final = 8192
"""Messages in one batch."""

CALLS_FLUSH_BYTES: Final = 32 * 1024
"""A frame of requests or replies is sent when its entries reach this size."""

CALLS_FLUSH_COUNT: Final = 32
"""A frame of requests or replies is also sent at this many entries, so that the receiver handles it while the
sender encodes the next."""

MAX_CALLS_PER_FRAME: Final = 4096
"""Entries in one REQUEST, REPLY or CANCEL frame."""

MAX_HEADER_STRING_BYTES: Final = 2048
MAX_HEADER_ARRAY: Final = 8192
MAX_HEADER_MAP: Final = 64
"""Limits of what a decoder allocates for a header before its fields are checked. (In a header without a list
field, arrays have at most MAX_HEADER_MAP elements, too.)"""

MAX_HEADER_BYTES: Final = 64 * 1024
"""The header of a frame with a payload: a receiver need not search further for its end."""

MAX_ERROR_TEXT: Final = 500
"""Characters of an ERROR, REFUSED, NOTICE or GOODBYE text, which the sender truncates."""

MAX_TYPE_NAME: Final = 255
"""Characters of a type name."""

MAX_LABELS: Final = 16
MAX_LABEL_NAME: Final = 64
MAX_LABEL_BYTES: Final = 256
MAX_LABELS_BYTES: Final = 1024
"""Labels of one node: how many, characters of a name, bytes of a value (and of `apart`), and bytes of all
names and values. One GRAPH frame has the labels of many nodes."""

MAX_DEFINITION_BYTES: Final = 64 * 1024
"""A type's definition; a type with a longer one is declared without it."""

MAX_DOMAIN: Final = 232
"""ROS 2's highest domain id that is safe on every platform."""

MAX_DEPTH: Final = 1_000_000
"""History depth of one publisher or subscription, in messages."""

MAX_QOS_NS: Final = 2**63 - 1
"""A QoS time (deadline, lifespan, lease), in nanoseconds: ROS 2's infinite duration."""

INSTANCE_BYTES: Final = 16
"""Length of instance ids, resume tokens and publisher gids."""

MAX_U32: Final = 2**32 - 1
MAX_U64: Final = 2**64 - 1
"""The largest values of msgpack integers and of 32-bit fields."""

HIGH_WATER_BYTES: Final = 128 * 1024
LOW_WATER_BYTES: Final = 32 * 1024
"""The transport's write buffer: small, so that few bytes wait outside the counted queues."""

NOTSENT_LOWAT_BYTES: Final = 128 * 1024
"""TCP_NOTSENT_LOWAT: the bytes that the kernel holds unsent, for the same reason."""

DEFAULT_KEEPALIVE_SEC: Final = 3.0
"""A peer that sends no byte for this long is considered frozen or disconnected."""

IDLE_KEEPALIVE_SEC: Final = 180.0
"""The same for a peer on which nobody relies, so that thousands of idle links cost little."""

HANDSHAKE_TIMEOUT_SEC: Final = 5.0
"""From the start of the connection to the end of the handshake, whatever bytes arrive in between."""

CLOSE_TIMEOUT_SEC: Final = 2.0
"""From the decision to close until the connection is aborted, however much the peer has not read."""
