"""Finding interfaces by name, and their text."""

from __future__ import annotations

import json
import sys
from typing import TYPE_CHECKING

import pytest

from actors.interfaces.catalog import interfaces_of
from actors.interfaces.codec import codec_for
from actors.interfaces.errors import UnknownInterfaceError
from actors.interfaces.file_packages import FileFinder, install_finder
from actors.interfaces.message import Message
from actors.interfaces.message import type_name as get_name
from actors.interfaces.registry import find_interface, installed_interface, interface_source
from actors.interfaces.std_msgs.msg import String
from tests.interfaces.imported import TYPES

if TYPE_CHECKING:
    from pathlib import Path


@pytest.mark.parametrize("name", ["std_msgs/msg/String", "std_msgs/String"])
def test_both_forms_of_a_name(name: str) -> None:
    """With and without the kind."""
    assert find_interface(name) is String


def test_an_interface_that_may_be_missing(monkeypatch: pytest.MonkeyPatch) -> None:
    """None, without a search for a suggestion: a graph may have a thousand unknown types."""
    monkeypatch.setattr("actors.interfaces.registry.interfaces_of", None)
    assert installed_interface("std_msgs/String") is String
    for name in ("std_msgs/msg/Strong", "nowhere/msg/Wheel", "nowhere/srv/Turn_Event", "no name"):
        assert installed_interface(name) is None


def test_every_standard_interface_is_found_and_can_be_made() -> None:
    """All packages, all interfaces, with defaults that fit."""
    names = [name for names in TYPES.values() for name in names]
    assert len(names) > 220
    for name in names:
        cls = find_interface(name)
        assert interface_source(name) is not None
        if issubclass(cls, Message):
            assert codec_for(cls).decode(codec_for(cls).encode(cls())) == cls()


def test_a_file_without_a_class_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """With the command that makes one; after `install_finder` there is a class."""
    (tmp_path / "registry_files" / "msg").mkdir(parents=True)
    (tmp_path / "registry_files" / "msg" / "Wheel.msg").write_text("int32 x\n")
    monkeypatch.setattr(sys, "path", [*sys.path, str(tmp_path)])
    monkeypatch.setattr(
        sys, "meta_path", [each for each in sys.meta_path if not isinstance(each, FileFinder)]
    )
    for name in ("registry_files/msg/Wheel", "registry_files/Wheel"):
        with pytest.raises(UnknownInterfaceError, match=r"callboard interface generate .*registry_files'"):
            find_interface(name)
    for name in [name for name in sys.modules if name.startswith("registry_files")]:
        del sys.modules[name]
    install_finder()
    assert get_name(find_interface("registry_files/Wheel")) == "registry_files/msg/Wheel"
    for name in [name for name in sys.modules if name.startswith("registry_files")]:
        del sys.modules[name]


def test_classes_of_this_program_are_found() -> None:
    """A hand-written class needs no generated package."""

    class Local(Message, type_name="no_such_package/msg/Local"):
        value: int = 3

    assert find_interface("no_such_package/msg/Local") is Local
    assert interface_source("no_such_package/Local") == "int64 value 3\n"


@pytest.mark.parametrize(
    ("name", "hint"),
    [
        ("std_msgs/msg/Strng", "did you mean std_msgs/msg/String"),
        ("std_mgs/String", "did you mean std_msgs/msg/String"),
        ("geometry_msgs/msg/pose", "did you mean geometry_msgs/msg/Pose"),
        ("String", "such as std_msgs/msg/String"),
        ("", "such as"),
        ("../../etc/passwd", "such as"),
        ("nothing_like_it/msg/Zzzzzzzz", "Unknown package 'nothing_like_it'"),
    ],
)
def test_unknown_names_get_a_suggestion(name: str, hint: str) -> None:
    """The nearest name, or the form."""
    with pytest.raises(UnknownInterfaceError, match=hint):
        find_interface(name)
    with pytest.raises(UnknownInterfaceError):
        interface_source(name)


def test_a_name_from_afar_imports_nothing_else(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A type name may come from another machine: only interface packages are imported for it."""
    (tmp_path / "trap_package").mkdir()
    (tmp_path / "trap_package" / "__init__.py").write_text("raise SystemExit('imported')")
    monkeypatch.syspath_prepend(tmp_path)
    for name in ("trap_package/msg/Boom", "antigravity/msg/Boom"):
        with pytest.raises(UnknownInterfaceError):
            find_interface(name)
    assert "trap_package" not in sys.modules
    assert "antigravity" not in sys.modules


@pytest.mark.parametrize("text", ["import no_such_module", "def"])
def test_a_package_that_cannot_be_imported(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, text: str
) -> None:
    """One error that says which, and why."""
    (tmp_path / "broken_msgs" / "msg").mkdir(parents=True)
    (tmp_path / "broken_msgs" / "msg" / "__init__.py").write_text(text)
    monkeypatch.syspath_prepend(tmp_path)
    assert installed_interface("broken_msgs/msg/Wheel") is None
    with pytest.raises(UnknownInterfaceError, match="'broken_msgs/msg/Wheel' cannot be imported: "):
        find_interface("broken_msgs/msg/Wheel")
    monkeypatch.delitem(sys.modules, "broken_msgs", raising=False)


def test_a_package_with_a_file_that_cannot_be_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A graph that has one of its types can be read; the error names the file."""
    (tmp_path / "unreadable_msgs" / "msg").mkdir(parents=True)
    (tmp_path / "unreadable_msgs" / "msg" / "Wheel.msg").write_text("int32 a")
    (tmp_path / "unreadable_msgs" / "msg" / "Axle.msg").mkdir()
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setattr(sys, "meta_path", list(sys.meta_path))
    install_finder()
    assert installed_interface("unreadable_msgs/msg/Wheel") is None
    with pytest.raises(UnknownInterfaceError, match=r"cannot be imported: .*Axle\.msg"):
        find_interface("unreadable_msgs/msg/Wheel")


def test_a_package_that_a_module_hides(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A folder of files with the name of a package of Python's is found, and that package remains."""
    (tmp_path / "json" / "msg").mkdir(parents=True)
    (tmp_path / "json" / "msg" / "Wheel.msg").write_text("Axle axle")
    (tmp_path / "json" / "msg" / "Axle.msg").write_text("float64 length 2.5")
    monkeypatch.setattr(sys, "path", [*sys.path, str(tmp_path)])
    monkeypatch.setattr(sys, "meta_path", list(sys.meta_path))
    monkeypatch.setattr(json, "msg", None, raising=False)  # which the import sets
    install_finder()
    wheel = find_interface("json/msg/Wheel")
    assert interface_source("json/msg/Axle") == "float64 length 2.5\n"
    assert get_name(wheel) == "json/msg/Wheel"
    assert json.dumps([]) == "[]"
    for name in [name for name in sys.modules if name.startswith("json.msg")]:
        del sys.modules[name]


def test_packages_list_their_interfaces() -> None:
    """Messages, services, actions; unknown packages get a suggestion."""
    assert interfaces_of("std_srvs") == ["std_srvs/srv/Empty", "std_srvs/srv/SetBool", "std_srvs/srv/Trigger"]
    assert len(interfaces_of("std_msgs")) == 30
    with pytest.raises(UnknownInterfaceError, match="did you mean std_msgs"):
        interfaces_of("std_msg")


def test_source_text() -> None:
    """Fields, constants, defaults and parts."""
    assert interface_source("std_srvs/srv/SetBool") == "bool data\n---\nbool success\nstring message\n"
    assert interface_source("geometry_msgs/Quaternion").endswith("float64 w 1.0\n")
    assert interface_source("std_msgs/Empty") == ""
    assert "int8 STATUS_FIX=0\n" in interface_source("sensor_msgs/NavSatStatus")
