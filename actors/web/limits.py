"""The limits of the web server, with their reasons. Each is read where it applies, when it applies."""

from __future__ import annotations

from typing import Final

MAX_BODY_BYTES: Final = 4 * 1024 * 1024
"""The body of a request whose sender has the right to make it."""

BODY_SEC: Final = 10.0
"""Seconds for such a body to arrive."""

MAX_MESSAGE_BYTES: Final = 4 * 1024 * 1024
"""Limit for a message of a live tool that may publish and call."""

MAX_READ_ONLY_MESSAGE_BYTES: Final = 256 * 1024
"""Limit for a message of a live tool that may only read: enough to subscribe to thousands of
channels."""

MAX_SIGN_IN_BYTES: Final = 8 * 1024
"""The body of a request to sign in, which anybody may send: a token has at most 512 characters."""

SIGN_IN_SEC: Final = 5.0
"""Seconds for such a body to arrive."""

READ_BYTES: Final = 16 * 1024
"""Bytes of a body that a connection keeps until its handler takes them; then it stops reading."""

LINGER_SEC: Final = 1.0
"""Seconds between an answer to a request whose body is not read, and the end of the connection. The end
discards what the client has not read yet, so the client gets this time to read the answer."""

KEEPALIVE_SEC: Final = 15.0
"""Seconds for the headers of the first request, and of the next one, to arrive."""

BACKLOG: Final = 1024
"""Connections that the kernel holds until they are accepted. It drops the next one, whose client tries again
after a second only."""

ACCEPTS_PER_TURN: Final = 64
"""Connections that are accepted in one loop turn: about a millisecond, also if most make room at once."""

FIRST_BYTE_SEC: Final = 10.0
"""Seconds for the first byte of a connection to arrive, which with HTTPS comes after the handshake."""

UNREAD_SEC: Final = 60.0
"""Seconds in which a client must read some of what waits for it; all of it may take longer on a slow link."""

MAX_UNREAD_BYTES: Final = 256 * 1024 * 1024
"""Bytes that connections hold until clients read them: messages of WebSockets, which have no pieces."""

MAX_HOLDER_UNREAD_BYTES: Final = 64 * 1024 * 1024
"""Those of one user, or of one address without a user: messages of the largest that pages show, in several
tabs."""

PIECE_BYTES: Final = 128 * 1024
"""An answer or event is given to a connection in pieces, each when the client has read the last one: it waits
once for all clients, not copied for each of them."""

MAX_CONNECTIONS: Final = 512
"""Open connections. A silent one costs a few KiB, with HTTPS 13 KiB and in mid-handshake 50 KiB."""

MAX_HOLDER_CONNECTIONS: Final = 128
"""Those of one user, or of one address without a user: of several browsers, or of a proxy. A browser has at
most six, and one for each WebSocket."""

RESERVED_CONNECTIONS: Final = 32
"""Connections beyond these limits on which only probes are answered; more than arrive at the same moment."""

MAX_SIGN_INS: Final = 32
"""Unknown tokens that the broker is asked about at the same time. It answers wrong ones late, so most of them
are wrong."""

MAX_SIGN_INS_OF_ADDRESS: Final = 8
"""Those of one address; further ones of it wait."""

RETRY_SEC: Final = 60
"""Seconds until an address may try a token again that the broker did not accept in time: for so long the
broker counts wrong ones."""

MAX_USERS: Final = 64
"""Workspaces of the broker's users, of each token at each address; then the one that has been unused for
longest makes room."""

MAX_USER_ADDRESSES: Final = 16
"""Addresses at which a token has a workspace, those that were left within the last minute included: a team
that shares a token leaves room for others, and cannot make the server open one workspace after the other."""

MAX_ACCEPTED_TOKENS: Final = 256
"""Tokens that the broker has accepted, which are remembered, as hashes, to try them without waiting."""

MAX_STREAMS: Final = 256
"""WebSockets of browsers, streams of events and requests for images at the same time."""

MAX_HOLDER_STREAMS: Final = 64
"""Those of one user, or of one address without a user: of tens of tabs, or of people behind a proxy."""

MAX_HELD_BYTES: Final = 64 * 1024 * 1024
"""Bodies of requests that are received or handled at the same time."""

MAX_HOLDER_HELD_BYTES: Final = 8 * 1024 * 1024
"""Those of one user, or of one address without a user: two of the largest, or thousands of usual ones."""
