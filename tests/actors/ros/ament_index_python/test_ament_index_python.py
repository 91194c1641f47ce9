"""The index of packages and resources, by ROS 2's names."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from actors.ros import ament_index_python as index
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
