"""Packages of ROS 2: in which folders they are, and what is in them."""

from __future__ import annotations

import sys
from pathlib import Path
from uuid import uuid4

import pytest

from actors.interfaces.catalog import share_folders
from actors.interfaces.errors import UnknownInterfaceError
from actors.interfaces.message import type_name
from actors.interfaces.registry import find_interface
from actors.tools.executables import find_package, packages
from actors.tools.prefixes import (
    INDEX,
    is_python_program,
    package_prefix,
    prefixes,
    resource,
    use_ros_interfaces,
)
from tests.interfaces.shares import no_shares


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


def test_interfaces_of_installed_packages_are_found(
    prefix: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Those of given prefixes, else of AMENT_PREFIX_PATH and of this Python, if ROS 2 is installed in it."""
    unique = f"prefix_{uuid4().hex}"  # a class is never forgotten in its process
    for name in ("given", "python"):
        (tmp_path / name / "share" / f"{unique}_{name}" / "msg").mkdir(parents=True)
        (tmp_path / name / "share" / f"{unique}_{name}" / "msg" / "Wheel.msg").write_text("int32 a\n")
    monkeypatch.setattr(sys, "prefix", str(tmp_path / "python"))
    monkeypatch.setattr(sys, "meta_path", [*sys.meta_path])
    with no_shares():
        use_ros_interfaces()
        assert share_folders == [prefix / "share"]
        (tmp_path / "python" / INDEX).mkdir(parents=True)
        use_ros_interfaces()
        assert share_folders == [prefix / "share", tmp_path / "python" / "share"]
        assert type_name(find_interface(f"{unique}_python/Wheel")) == f"{unique}_python/msg/Wheel"
        with pytest.raises(UnknownInterfaceError):
            find_interface(f"{unique}_given/Wheel")
        use_ros_interfaces(str(tmp_path / "given"), tmp_path / "nowhere")
        assert share_folders[2:] == [tmp_path / "given" / "share"]
        assert type_name(find_interface(f"{unique}_given/Wheel")) == f"{unique}_given/msg/Wheel"


def test_without_ros_2_nothing_is_searched(monkeypatch: pytest.MonkeyPatch) -> None:
    """Nor imported: this costs commands nothing."""
    monkeypatch.delenv("AMENT_PREFIX_PATH", raising=False)
    monkeypatch.setitem(sys.modules, "actors.interfaces.share_packages", None)
    with no_shares():
        use_ros_interfaces()
        assert not share_folders
