"""The index of packages and resources, by ROS 2's names."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from actors.ros import ament_index_python as index
from actors.ros.interface_resources import MAX_FOLDERS, interface_prefix
from actors.tools.prefixes import INDEX

if TYPE_CHECKING:
    from pathlib import Path


@pytest.fixture
def prefix(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with a package and a resource, in AMENT_PREFIX_PATH."""
    for kind, name in (("packages", "my_data"), ("plugins", "one")):
        (tmp_path / INDEX / kind).mkdir(parents=True)
        (tmp_path / INDEX / kind / name).write_text(f"text of {name}")
    (tmp_path / "share" / "my_data").mkdir(parents=True)
    (tmp_path / "share" / "my_data" / "package.xml").write_text("<package/>")
    monkeypatch.setenv("AMENT_PREFIX_PATH", str(tmp_path))
    return tmp_path


def test_packages_have_folders(prefix: Path) -> None:
    """Those of the index, and Python packages."""
    assert index.get_package_prefix("my_data") == str(prefix)
    assert index.get_package_share_directory("my_data") == str(prefix / "share" / "my_data")
    assert index.get_package_share_path("pytest").is_dir()
    assert index.get_packages_with_prefixes()["my_data"] == str(prefix)
    assert index.get_search_paths()[0] == str(prefix)
    with pytest.raises(index.PackageNotFoundError, match="No package 'none' is installed"):
        index.get_package_prefix("none")


def test_resources_are_files_of_the_index(prefix: Path) -> None:
    """Their contents, and where they are."""
    assert index.get_resource("plugins", "one") == ("text of one", str(prefix))
    assert index.get_resource_path("plugins", "one").read_text() == "text of one"
    assert index.get_resources("plugins") == {"one": str(prefix)}
    assert {"packages", "plugins"} <= index.get_resource_types()
    assert index.has_resource("plugins", "one") == str(prefix)
    assert index.has_resource("plugins", "two") is False
    with pytest.raises(LookupError, match="No resource 'two' of type 'plugins'"):
        index.get_resource("plugins", "two")


@pytest.mark.usefixtures("prefix")
def test_names_are_no_paths() -> None:
    """Neither types nor names."""
    with pytest.raises(index.InvalidResourceTypeNameError):
        index.has_resource("../x", "one")
    with pytest.raises(index.InvalidResourceTypeNameError):
        index.get_resources("")
    with pytest.raises(index.InvalidResourceNameError):
        index.get_resource("plugins", "..")


def test_bundled_interface_packages_are_installed(prefix: Path) -> None:
    """As folders with the texts of their types, which another package of the same name replaces."""
    share = index.get_package_share_path("std_srvs")
    assert (share / "srv" / "SetBool.srv").read_text().split() == [
        "bool",
        "data",
        "---",
        "bool",
        "success",
        "string",
        "message",
    ]
    content, folder = index.get_resource("rosidl_interfaces", "std_srvs")
    assert content.splitlines() == ["srv/Empty.srv", "srv/SetBool.srv", "srv/Trigger.srv"]
    assert index.get_package_prefix("std_srvs") == folder == index.get_search_paths()[-1]
    assert {"std_msgs", "example_interfaces"} <= index.get_packages_with_prefixes().keys()
    (prefix / INDEX / "packages" / "std_srvs").touch()
    assert index.get_package_prefix("std_srvs") == str(prefix)


def test_the_folders_of_other_versions_are_removed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """All but the newest."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    folder = tmp_path / "callboard" / "interfaces"
    for name in "abcd":
        (folder / name).mkdir(parents=True)
    prefix = interface_prefix()
    kept = set(folder.iterdir())
    assert prefix in kept
    assert len(kept) == MAX_FOLDERS


def test_a_folder_may_disappear_while_others_are_removed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Another process has removed it; a link to nowhere stands for it."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    folder = tmp_path / "callboard" / "interfaces"
    folder.mkdir(parents=True)
    (folder / "gone").symlink_to("nowhere")
    assert interface_prefix().parent == folder


def test_a_cache_that_cannot_be_written_to_is_not_needed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The folder is a temporary one then."""
    (tmp_path / "file").touch()
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "file"))
    assert (interface_prefix() / "share" / "std_msgs" / "msg" / "String.msg").is_file()


def test_a_temporary_folder_is_used_if_writing_fails_later(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A file in the folder's place stands for a full disk."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "a"))
    name = interface_prefix().name
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "b"))
    parent = tmp_path / "b" / "callboard" / "interfaces"
    parent.mkdir(parents=True)
    (parent / name).touch()
    assert (interface_prefix() / "share" / "std_msgs" / "msg" / "String.msg").is_file()
    assert [each.name for each in parent.iterdir()] == [name]
