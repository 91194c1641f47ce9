"""Packages of ROS 2: in which folders they are, and what is in them."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from actors.tools.executables import find_package, packages
from actors.tools.prefixes import INDEX, is_python_program, package_prefix, prefixes, resource


@pytest.fixture
def prefix(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with the package `my_data`, in AMENT_PREFIX_PATH."""
    (tmp_path / INDEX / "packages").mkdir(parents=True)
    (tmp_path / INDEX / "packages" / "my_data").write_text("")
    share = tmp_path / "share" / "my_data"
    (share / "launch").mkdir(parents=True)
    (share / "package.xml").write_text("<package><name>my_data</name><version>1.2.3</version></package>")
    library = tmp_path / "lib" / "my_data"
    library.mkdir(parents=True)
    (library / "talker").write_text("#!/usr/bin/python3\nimport sys\nprint(__name__, sys.argv[0])\n")
    (library / "binary").write_bytes(b"\x7fELF")
    monkeypatch.setenv("AMENT_PREFIX_PATH", f"{tmp_path}:/none")
    return tmp_path


def test_folders_are_searched_in_their_order(prefix: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """AMENT_PREFIX_PATH, this Python, and folders of the path that have an index; each once."""
    monkeypatch.syspath_prepend(prefix)
    assert prefixes() == [prefix, Path(sys.prefix)]
    monkeypatch.delenv("AMENT_PREFIX_PATH")
    assert prefixes() == [Path(sys.prefix), prefix]


def test_a_package_is_found_by_the_index_or_its_file(prefix: Path) -> None:
    """What is no name finds nothing."""
    assert resource("packages", "my_data") == prefix
    assert package_prefix("my_data") == prefix
    (prefix / INDEX / "packages" / "my_data").unlink()
    assert package_prefix("my_data") == prefix
    for name in ("", "..", "share/my_data", "none"):
        assert package_prefix(name) is None


def test_a_package_of_data_has_programs(prefix: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Those that Python runs, from `lib/PACKAGE`."""
    package = find_package("my_data")
    assert package is not None
    assert (package.version, package.prefix(), package.share()) == (
        "1.2.3",
        prefix,
        prefix / "share" / "my_data",
    )
    assert (package.uses_callboard, package.modules()) == (False, [])
    (program,) = package.executables()
    assert (program.name, program.path) == ("talker", prefix / "lib" / "my_data" / "talker")
    exec(program.command(), {})
    assert capsys.readouterr().out == f"__main__ {program.path}\n"
    assert "my_data" in {each.name for each in packages()}


def test_a_package_without_its_file_has_no_version(prefix: Path) -> None:
    """Nor a folder of data."""
    (prefix / "share" / "my_data" / "package.xml").unlink()
    package = find_package("my_data")
    assert package is not None
    assert (package.version, package.share()) == ("", None)


@pytest.mark.parametrize(
    ("name", "content", "expected"),
    [("a.py", b"", True), ("a", b"#!/usr/bin/env python3\n", True), ("a", b"#!/bin/sh\n", False)],
)
def test_python_runs_what_says_so(tmp_path: Path, name: str, content: bytes, *, expected: bool) -> None:
    """By its name or its first line; a file that does not exist is none."""
    assert not is_python_program(tmp_path / name)
    (tmp_path / name).write_bytes(content)
    assert is_python_program(tmp_path / name) is expected
