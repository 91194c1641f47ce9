"""Keys, on a terminal of the test's own."""

from __future__ import annotations

import os
import sys
from contextlib import aclosing

import pytest

from actors.cli.keys import keys

pty = pytest.importorskip("pty")


async def test_keys_end_with_their_terminal(monkeypatch: pytest.MonkeyPatch) -> None:
    """A program whose window is closed goes on without keys."""
    window, inside = pty.openpty()
    try:
        with os.fdopen(inside) as stdin:
            monkeypatch.setattr(sys, "stdin", stdin)
            async with aclosing(keys()) as pressed:
                os.write(window, b"a\n")
                assert await anext(pressed) == "a"
                assert await anext(pressed) == "\n"
                # Keys that are held come together.
                os.write(window, b"\x1b[C\x1b[1;5Ax\x1bOA\n")
                assert [await anext(pressed) for _ in range(5)] == [
                    "\x1b[C",
                    "\x1b[1;5A",
                    "x",
                    "\x1bOA",
                    "\n",
                ]
                os.close(window)
                window = -1
                with pytest.raises(StopAsyncIteration):
                    await anext(pressed)
    finally:
        if window >= 0:
            os.close(window)
