"""The limits of the web server, with their reasons. Each is read where it applies, when it applies."""

from __future__ import annotations

from typing import Final

MAX_BODY_BYTES: Final = 4 * 1024 * 1024
"""The body of a request whose sender has the right to make it."""

BODY_SEC: Final = 10.0
"""Seconds for such a body to arrive."""

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
