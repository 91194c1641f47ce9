"""Case 85: a launch file whose values multiply is refused before it fills all memory."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import pytest

from actors.cli.main import main
from actors.launch.description import substitutions

if TYPE_CHECKING:
    from pathlib import Path

TIMES: Final = 30
YAML: Final = (
    "launch:\n- let: {name: a, value: xxxxxxxx}\n"
    + "- let: {name: a, value: $(var a)$(var a)}\n" * TIMES
    + "- log: {message: $(var a)}\n"
)
XML: Final = (
    "<launch><let name='a' value='xxxxxxxx'/>"
    + "<let name='a' value='$(var a)$(var a)'/>" * TIMES
    + "<log message='$(var a)'/></launch>"
)
PYTHON: Final = f"""
from actors.launch import LaunchConfiguration, LaunchDescription, SetLaunchConfiguration

def generate_launch_description():
    a = LaunchConfiguration("a")
    doubled = [SetLaunchConfiguration("a", [a, a]) for _ in range({TIMES})]
    return LaunchDescription([SetLaunchConfiguration("a", "xxxxxxxx"), *doubled])
"""


@pytest.mark.parametrize(
    ("name", "text"), [("a.launch.yaml", YAML), ("a.launch.xml", XML), ("a.launch.py", PYTHON)]
)
@pytest.mark.parametrize(
    ("limit", "most", "reason"),
    [
        ("MAX_TEXT", 1000, "longer than 1000 characters"),
        ("MAX_TEXTS", 2000, "more than 2000 characters together"),
    ],
)
def test_values_that_double_are_refused(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    *,
    name: str,
    text: str,
    limit: str,
    most: int,
    reason: str,
) -> None:
    """Case 85: one text, and all together; the error names the file."""
    monkeypatch.setattr(substitutions, limit, most)
    file = tmp_path / name
    file.write_text(text, encoding="utf-8")
    assert main(["launch", str(file), "--dry-run"]) == 1
    error = capsys.readouterr().err
    assert reason in error
    assert str(file) in error


@pytest.mark.parametrize(
    "entry",
    [
        "- execute_process: {cmd: {long}}",
        "- executable: {cmd: echo, launch-prefix: {long}}",
        "- node: {pkg: a, exec: b, args: {long}}",
        "- log: {message: '$(command {long})'}",
    ],
)
def test_a_long_command_is_not_split(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], entry: str
) -> None:
    """Case 85: splitting takes time with the square of a word's length, so it has a limit of its own."""
    monkeypatch.setattr(substitutions, "MAX_COMMAND", 1000)
    file = tmp_path / "a.launch.yaml"
    file.write_text("launch:\n" + entry.replace("{long}", "x" * 1001) + "\n", encoding="utf-8")
    assert main(["launch", str(file), "--dry-run"]) == 1
    error = capsys.readouterr().err
    assert "more than 1000 characters" in error
    assert str(file) in error
