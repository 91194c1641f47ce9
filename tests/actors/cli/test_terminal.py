"""The terminal's width is found without help, and nothing that is odd stops a command."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest

from actors.cli.terminal import columns, terminal_width


@pytest.mark.parametrize(("said", "wide"), [("132", 132), ("0", 80), ("-3", 80), ("x", 80), ("", 80)])
def test_the_environment_says_how_wide(monkeypatch: pytest.MonkeyPatch, said: str, wide: int) -> None:
    """COLUMNS counts if it is a number; without a terminal there are 80."""
    monkeypatch.setenv("COLUMNS", said)
    assert columns() == wide
    assert terminal_width() is None


def test_the_terminal_says_how_wide(monkeypatch: pytest.MonkeyPatch) -> None:
    """Unless it does not know."""
    monkeypatch.delenv("COLUMNS", raising=False)
    monkeypatch.setattr(sys.stdout, "isatty", lambda: True)
    monkeypatch.setattr(sys.stdout, "fileno", lambda: 1)
    monkeypatch.setattr(os, "get_terminal_size", lambda number: os.terminal_size((60, 20)))
    assert terminal_width() == 60
    monkeypatch.setattr(os, "get_terminal_size", lambda number: os.terminal_size((0, 0)))
    assert terminal_width() == 80
    monkeypatch.setattr(sys, "stdout", None)
    assert columns() == 80


@pytest.mark.processes
def test_a_query_imports_only_what_it_needs() -> None:
    """What takes milliseconds and is not needed stays out: codecs of host names, shutil, difflib."""
    unneeded = {"shutil", "difflib", "encodings.idna", "asyncio", "msgspec"}
    code = (
        "import sys; from actors.cli.main import main;"
        "main(['topic', 'list', '--url', 'callboard://127.0.0.1:1']);"
        f"sys.exit(' '.join({unneeded} & set(sys.modules)))"
    )
    ended = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, timeout=50, check=False
    )
    assert ended.stderr.splitlines()[1:] == [""]
