"""Every limit of the wire, with its reason. Sizes are bytes unless the name says otherwise.

What happens at a limit is stated in docs/protocol.md: the guilty connection gets an ERROR frame that names
the limit, and closes.
"""

from __future__ import annotations

from typing import Final

PROTOCOL_VERSION: Final = 1
"""What HELLO and WELCOME carry; it changes when an old peer could not follow."""

PREFIX_BYTES: Final = 5
"""A frame starts with msgpack's `bin 32` head: 0xc6 and a big-endian u32."""

MAX_FRAME_BYTES: Final = 256 * 1024
"""Content of one frame. Small enough that a large message never holds a link for long."""

MAX_HELLO_BYTES: Final = 4 * 1024
"""Content of a frame before the session is open: a stranger gets no large buffer."""

FRAGMENT_BYTES: Final = 128 * 1024
"""Payload of one FRAGMENT that we send: other lanes get their turn after each."""

MAX_MESSAGE_BYTES: Final = 64 * 1024 * 1024
"""A reassembled frame: one message, request or reply with its header."""

MAX_TRANSFERS: Final = 8
"""Fragmented frames under way on one link in one direction: bounds a receiver's reassembly memory."""

BATCH_FLUSH_BYTES: Final = 48 * 1024
"""A run is sent when its body reaches this size, without waiting for the end of the loop turn."""

BATCH_FLUSH_COUNT: Final = 4096
"""... or this many messages: keeps the table of message ends far below a frame."""

MAX_QUEUE_BYTES: Final = 64 * 1024 * 1024
"""Messages waiting in one KEEP_LAST lane, whatever its depth: beyond it the oldest are dropped, too."""

BATCH_OVERHEAD_BYTES: Final = 512
"""What a waiting run takes of memory beside its messages, about; only a link's ceiling counts it."""

MAX_BATCH_COUNT: Final = 8192
"""Messages in one run."""

CALLS_FLUSH_BYTES: Final = 32 * 1024
"""Entries of requests or replies that travel in one frame."""

CALLS_FLUSH_COUNT: Final = 32
"""... or this many: while one frame is on its way the next is being made, on another core."""

MAX_CALLS_PER_FRAME: Final = 4096
"""Entries in one REQUEST, REPLY or CANCEL frame."""

MAX_HEADER_STRING_BYTES: Final = 2048
MAX_HEADER_ARRAY: Final = 8192
MAX_HEADER_MAP: Final = 64
"""Caps on what a header may make a decoder allocate before its fields are checked. (In a header without a
list field an array, too, has at most MAX_HEADER_MAP elements.)"""

MAX_HEADER_BYTES: Final = 64 * 1024
"""The header of a frame with a payload: a receiver need not look further for its end."""

MAX_ERROR_TEXT: Final = 500
"""Characters of an ERROR, REFUSED, NOTICE or GOODBYE text; the sender cuts. Four bytes each still fit."""

MAX_TYPE_NAME: Final = 255
"""Characters of a type name."""

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
"""What msgpack and the 32-bit fields hold."""

HIGH_WATER_BYTES: Final = 128 * 1024
LOW_WATER_BYTES: Final = 32 * 1024
"""The transport's write buffer: shallow, so that what is outside the counted queues stays little."""

NOTSENT_LOWAT_BYTES: Final = 128 * 1024
"""TCP_NOTSENT_LOWAT: what the kernel may hold unsent, for the same reason."""

DEFAULT_KEEPALIVE_SEC: Final = 3.0
"""A peer from which no byte came for this long is taken for frozen or unplugged."""

IDLE_KEEPALIVE_SEC: Final = 180.0
"""The same for a peer that nobody relies on, so that thousands of idle links cost nothing."""

HANDSHAKE_TIMEOUT_SEC: Final = 5.0
"""From the connection's first moment to a finished handshake, whatever bytes drip in between."""

CLOSE_TIMEOUT_SEC: Final = 2.0
"""From the decision to close until the connection is cut, however much the peer has left unread."""
