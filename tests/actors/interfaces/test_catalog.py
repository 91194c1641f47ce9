"""Which packages and types there are, found without importing classes."""

from __future__ import annotations

import subprocess
import sys
from typing import TYPE_CHECKING

import pytest

from actors.interfaces.catalog import (
    interfaces_of,
    is_standard,
    known_packages,
    python_package,
    source_file,
    standard_packages,
)
from actors.interfaces.errors import UnknownInterfaceError
from actors.interfaces.generator import generate
from tests.calls import calls_of

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path


@pytest.fixture
def workspace(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A folder on the import path: a generated package, one of text only, and others that are none."""
    for package in ("catalog_made", "catalog_text"):
        (tmp_path / package / "msg").mkdir(parents=True)
        (tmp_path / package / "msg" / "Wheel.msg").write_text("float64 speed # m/s\n")
    (tmp_path / "catalog_text" / "srv").mkdir()
    (tmp_path / "catalog_text" / "srv" / "Stop.srv").write_text("---\n")
    (tmp_path / "catalog_text" / "srv" / "notes.srv").write_text("not a type")
    (tmp_path / "catalog_text" / "msg" / "Axle.idl").write_text("")
    (tmp_path / "catalog_text" / "msg" / "Wheel.idl").write_text("")
    generate(tmp_path / "catalog_made")
    for other in ("catalog_other/msg", "catalog_empty/srv", "catalog_plain"):
        (tmp_path / other).mkdir(parents=True)
        (tmp_path / other / "__init__.py").write_text("raise SystemExit('imported')")
    monkeypatch.syspath_prepend(tmp_path)
    yield tmp_path
    for module in [name for name in sys.modules if name.startswith("catalog_")]:
        del sys.modules[module]


@pytest.mark.usefixtures("workspace")
def test_packages_on_the_import_path_are_known() -> None:
    """Generated ones and folders of text, beside the standard ones; other packages are not imported."""
    known = known_packages()
    assert {"catalog_made", "catalog_text", *standard_packages()} <= set(known)
    assert not {"catalog_other", "catalog_empty", "catalog_plain"} & set(known)
    assert known == sorted(known)


def test_types_of_a_package(workspace: Path) -> None:
    """Messages first, without running the package; one that is only text has them, too."""
    (workspace / "catalog_made" / "__init__.py").write_text("raise SystemExit('imported')")
    assert interfaces_of("catalog_made") == ["catalog_made/msg/Wheel"]
    assert interfaces_of("catalog_text") == [
        "catalog_text/msg/Axle",
        "catalog_text/msg/Wheel",
        "catalog_text/srv/Stop",
    ]
    assert python_package("catalog_made", "msg") == "catalog_made.msg"
    assert python_package("catalog_text", "msg") is None


def test_source_files(workspace: Path) -> None:
    """The text beside generated classes, or alone; standard types have none, and no path leads elsewhere."""
    for package in ("catalog_made", "catalog_text"):
        assert source_file(package, "msg", "Wheel") == workspace / package / "msg" / "Wheel.msg"
    assert source_file("catalog_text", "msg", "Axle") == workspace / "catalog_text" / "msg" / "Axle.idl"
    for name in (
        ("catalog_text", "msg", "Wheels"),
        ("std_msgs", "msg", "String"),
        ("..", "msg", "Wheel"),
        ("catalog_text", "..", "Wheel"),
        ("catalog_text", "msg", "../Wheel"),
    ):
        assert source_file(*name) is None


@pytest.mark.parametrize("name", ["catalog__text", "catalog_text_"])
def test_a_folder_whose_name_no_package_may_have(workspace: Path, name: str) -> None:
    """Two underscores and one at the end: what ROS and `interface generate` refuse is not listed, either."""
    (workspace / "catalog_text").rename(workspace / name)
    assert name not in known_packages()
    assert source_file(name, "msg", "Wheel") is None


@pytest.mark.parametrize(
    ("package", "text"),
    [
        ("std_msg", "Unknown package 'std_msg'; did you mean std_msgs?"),
        ("qqqqqqqq", "Unknown package 'qqqqqqqq'"),
        ("../std_msgs", "Unknown package '../std_msgs'; did you mean std_msgs?"),
    ],
)
def test_unknown_packages(package: str, text: str) -> None:
    """ROS 2's text, with what may have been meant."""
    with pytest.raises(UnknownInterfaceError) as caught:
        interfaces_of(package)
    assert str(caught.value) == text


def test_one_package_is_looked_at_without_the_others() -> None:
    """A list of all packages would otherwise take time in proportion to the square of their number."""
    assert all(map(is_standard, standard_packages()))
    assert not any(map(is_standard, ("", "..", "../interfaces/std_msgs", "std_msgs/msg", "catalog_made")))
    assert calls_of(lambda: interfaces_of("std_msgs")) < calls_of(standard_packages)


@pytest.mark.processes
def test_lists_need_no_classes() -> None:
    """The names of all standard types are there without msgspec."""
    code = (
        "import sys; from actors.interfaces.catalog import interfaces_of, known_packages\n"
        "for package in known_packages(): assert interfaces_of(package)\n"
        "sys.exit('msgspec' in sys.modules)"
    )
    subprocess.run([sys.executable, "-c", code], check=True, timeout=50)


@pytest.mark.parametrize("name", ["test", "json", "catalog_hidden"])
def test_a_folder_with_the_name_of_a_module(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its texts are found, although `import` finds the module; a generated package there is no package."""
    earlier, later = tmp_path / "earlier", tmp_path / "later"
    (earlier / "catalog_hidden").mkdir(parents=True)
    (earlier / "catalog_hidden" / "__init__.py").touch()
    for path in (earlier, later):
        monkeypatch.syspath_prepend(path)
    monkeypatch.setattr(sys, "path", [*sys.path[2:], str(earlier), str(later)])  # as the current directory
    (later / name / "msg").mkdir(parents=True)
    text = later / name / "msg" / "Wheel.msg"
    text.write_text("float64 speed\n", encoding="utf-8")
    assert name in known_packages()
    assert interfaces_of(name) == [f"{name}/msg/Wheel"]
    assert source_file(name, "msg", "Wheel") == text
    assert python_package(name, "msg") is None
    generate(later / name)
    text.unlink()
    assert name not in known_packages()
    with pytest.raises(UnknownInterfaceError):
        interfaces_of(name)
