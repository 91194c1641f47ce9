"""`callboard interface`: definitions, lists, generated classes."""

from __future__ import annotations

import json
import sys
from typing import TYPE_CHECKING

import pytest

from actors.cli.main import main

if TYPE_CHECKING:
    from pathlib import Path


@pytest.fixture(autouse=True)
def _own_path(monkeypatch: pytest.MonkeyPatch) -> None:
    """What commands add to the import path is taken back."""
    monkeypatch.setattr(sys, "path", [*sys.path])


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("std_msgs/msg/String", "string data\n"),
        ("std_msgs/String", "string data\n"),
        ("example_interfaces/srv/AddTwoInts", "int64 a\nint64 b\n---\nint64 sum\n"),
    ],
)
def test_show_prints_the_definition(capsys: pytest.CaptureFixture[str], name: str, text: str) -> None:
    """As a .msg or .srv file has it."""
    assert main(["interface", "show", name]) == 0
    assert capsys.readouterr().out == text


def test_show_json_has_the_full_name(capsys: pytest.CaptureFixture[str]) -> None:
    """Also for a short one."""
    main(["interface", "show", "std_msgs/String", "--json"])
    document = json.loads(capsys.readouterr().out)
    assert document == {"name": "std_msgs/msg/String", "definition": "string data\n"}


def test_show_knows_what_was_meant(capsys: pytest.CaptureFixture[str]) -> None:
    """A mistyped name fails with a suggestion."""
    assert main(["interface", "show", "std_msgs/msg/Strin"]) == 1
    assert capsys.readouterr().err == (
        "No interface 'std_msgs/msg/Strin'; did you mean std_msgs/msg/String?\n"
    )


def test_list_is_by_kind(capsys: pytest.CaptureFixture[str]) -> None:
    """Messages, services and actions under their headings."""
    main(["interface", "list"])
    lines = capsys.readouterr().out.splitlines()
    messages, services, actions = map(lines.index, ("Messages:", "Services:", "Actions:"))
    assert messages < lines.index("    std_msgs/msg/String") < services
    assert services < lines.index("    std_srvs/srv/Trigger") < actions


def test_package_lists_its_types(capsys: pytest.CaptureFixture[str]) -> None:
    """One a line, or as a JSON array."""
    main(["interface", "package", "std_srvs"])
    names = capsys.readouterr().out.split()
    assert names == [f"std_srvs/srv/{name}" for name in ("Empty", "SetBool", "Trigger")]
    main(["interface", "package", "std_srvs", "--json"])
    assert json.loads(capsys.readouterr().out) == names


def test_generated_classes_are_found_from_their_directory(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Generate prints what it wrote; the other verbs then know the package."""
    source = tmp_path / "src" / "cli_test_interfaces" / "msg"
    source.mkdir(parents=True)
    (source / "Wheel.msg").write_text("float64 speed\n")
    assert main(["interface", "generate", str(source.parent), "--output", str(tmp_path), "--json"]) == 0
    package = tmp_path / "cli_test_interfaces"
    assert str(package / "msg" / "_wheel.py") in json.loads(capsys.readouterr().out)
    monkeypatch.chdir(tmp_path)
    assert main(["interface", "show", "cli_test_interfaces/msg/Wheel"]) == 0
    assert capsys.readouterr().out == "float64 speed\n"


def test_generate_names_file_and_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A bad definition fails in one line."""
    source = tmp_path / "wheels" / "msg"
    source.mkdir(parents=True)
    (source / "Wheel.msg").write_text("float64 speed\nnonsense!\n")
    assert main(["interface", "generate", str(source.parent)]) == 1
    captured = capsys.readouterr()
    assert "Wheel.msg:2: " in captured.err
    assert captured.err.count("\n") == 1


def test_generate_wants_a_directory(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A missing one is named."""
    assert main(["interface", "generate", str(tmp_path / "no")]) == 1
    assert capsys.readouterr().err == f"No directory '{tmp_path / 'no'}'\n"
