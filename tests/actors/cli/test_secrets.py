"""Case 33: no command shows the token that it uses."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from actors.cli.main import main

if TYPE_CHECKING:
    from pathlib import Path

TOKEN = "cbt_" + "s" * 43


@pytest.mark.parametrize(
    "command",
    [
        ["doctor", "--json"],
        ["doctor"],
        ["context", "show"],
        ["context", "show", "--json"],
        ["context", "list", "--json"],
        ["topic", "list"],
        ["launch", "FILE", "--dry-run"],
        ["launch", "FILE", "--print-description"],
    ],
)
def test_no_output_has_the_token(
    command: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    """Neither stdout nor stderr, in text or JSON, with or without a broker."""
    file = tmp_path / "one.yaml"
    file.write_text("launch:\n- executable:\n    cmd: printenv HOME\n")
    monkeypatch.setenv("CALLBOARD_TOKEN", TOKEN)
    monkeypatch.setenv("CALLBOARD_URL", "callboard://127.0.0.1:1")
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path))
    main([str(file) if word == "FILE" else word for word in command])
    shown = capfd.readouterr()
    assert shown.out or shown.err
    assert TOKEN not in shown.out + shown.err
