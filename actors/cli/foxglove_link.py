"""The link that opens a server in Foxglove."""

from __future__ import annotations

from urllib.parse import quote


def foxglove_link(address: str) -> str:
    """Return the link that opens Foxglove with a server.

    A token must not be sent to Foxglove's site. So a link with one opens the desktop application.

    Args:
        address: The server's, as "ws://127.0.0.1:8765/", perhaps with a token.
    """
    where = "foxglove://open" if "?" in address else "https://app.foxglove.dev/~/view"
    return f"{where}?ds=foxglove-websocket&ds.url={quote(address, safe='')}"
