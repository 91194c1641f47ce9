"""The address for the user's browser, so that other users of the machine do not see a page's token."""

from __future__ import annotations

import html
from contextlib import contextmanager
from pathlib import Path
from tempfile import NamedTemporaryFile
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Generator


@contextmanager
def browser_address(url: str) -> Generator[str]:
    """Return an address that leads to a page and may be seen by everybody.

    A browser's command line is visible to all users of the machine. So an address with a token is written to
    a file of this user alone, which leads there, and is deleted at the end of the context.

    Args:
        url: The page's address; what is behind its `#` is secret.
    """
    if "#" not in url:
        yield url
        return
    with NamedTemporaryFile("w", prefix="callboard-", suffix=".html", encoding="utf-8") as file:  # mode 0600
        file.write(f'<!doctype html><meta http-equiv="refresh" content="0; url={html.escape(url)}">')
        file.flush()
        yield Path(file.name).as_uri()
