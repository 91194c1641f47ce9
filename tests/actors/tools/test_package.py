"""A new package: its files, and what cannot be one."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

import pytest

import actors.tools
from actors.tools.package import (
    MAX_NAME_LENGTH,
    InvalidPackageError,
    NewPackage,
    comes_with_callboard,
    suggested_name,
)

ROOT = Path(__file__).parents[3]


def new(name: str = "my_robot", **fields: Any) -> NewPackage:
    """Describe a package; what is not said is something usual."""
    usual = {"maintainer_name": "Ada", "maintainer_email": "ada@example.org", "year": 1843}
    return NewPackage(name=name, **{**usual, **fields})


def project(package: NewPackage) -> dict[str, Any]:
    """Return what its pyproject.toml says."""
    return tomllib.loads(package.files()["pyproject.toml"])


def test_a_node_has_a_module_a_program_and_a_test() -> None:
    """And there is a place for launch files."""
    package = new(node_name="fast_talker")
    assert list(package.files()) == [
        "pyproject.toml",
        "README.md",
        ".gitignore",
        "my_robot/__init__.py",
        "my_robot/fast_talker.py",
        "my_robot/launch/README.md",
        "tests/test_fast_talker.py",
    ]
    assert project(package)["project"]["scripts"] == {"fast_talker": "my_robot.fast_talker:main"}
    assert "class FastTalker(callboard.Node):" in package.files()["my_robot/fast_talker.py"]
    assert "callboard run my_robot fast_talker" in package.files()["README.md"]


def test_a_package_without_a_node_has_a_test_too() -> None:
    """And an example of a program, as a comment."""
    package = new()
    assert "tests/test_my_robot.py" in package.files()
    assert project(package)["project"]["scripts"] == {}
    assert '# talker = "my_robot.talker:main"' in package.files()["pyproject.toml"]


@pytest.mark.parametrize("node_name", [None, "talker"])
def test_every_file_is_filled_in(node_name: str | None) -> None:
    """Python files compile, no placeholder is left, and each ends with a line end."""
    for path, text in new(node_name=node_name, license_name="MIT").files().items():
        assert "$" not in text, path
        assert text.endswith("\n"), path
        if path.endswith(".py"):
            compile(text, path, "exec")


def test_pyproject_says_what_has_been_said() -> None:
    """Also with quotes, backslashes and other alphabets in it."""
    said = r'The "fast" robot \o/ жω'
    fields = project(
        new(
            description=said,
            license_name="mit",
            maintainer_name="Ada Löve",
            dependencies=("numpy>=2; python_version>'3.11'", "callboard"),
        )
    )["project"]
    assert fields["name"] == "my_robot"
    assert fields["description"] == said
    assert fields["license"] == "MIT"
    assert fields["license-files"] == ["LICENSE"]
    assert fields["maintainers"] == [{"name": "Ada Löve", "email": "ada@example.org"}]
    assert fields["dependencies"] == ["callboard", "numpy>=2; python_version>'3.11'"]


def test_a_license_without_text_is_only_named() -> None:
    """One that is still to come is a comment: "TODO" is no licence."""
    package = new(license_name="Proprietary")
    assert project(package)["project"]["license"] == "LicenseRef-Proprietary"
    assert "LICENSE" not in package.files()
    package = new()
    assert "license" not in project(package)["project"]
    assert "# TODO: License declaration\n" in package.files()["pyproject.toml"]


def test_write_makes_the_folder_and_its_files(tmp_path: Path) -> None:
    """It says what is new, in order, each folder before what is in it."""
    package = new(node_name="talker", license_name="BSD-3-Clause")
    written = package.write(tmp_path / "new" / "src")
    assert written[:2] == ["my_robot/", "my_robot/pyproject.toml"]
    assert written.index("my_robot/my_robot/launch/") < written.index("my_robot/my_robot/launch/README.md")
    for path in written:
        there = tmp_path / "new" / "src" / path
        assert there.is_dir() if path.endswith("/") else there.is_file()
    text = (tmp_path / "new" / "src" / "my_robot" / "LICENSE").read_text(encoding="utf-8")
    assert "1843 Ada" in text


def test_what_is_there_stays_as_it_is(tmp_path: Path) -> None:
    """Nothing is written into a folder that exists."""
    (tmp_path / "my_robot").mkdir()
    with pytest.raises(FileExistsError):
        new().write(tmp_path)
    assert list((tmp_path / "my_robot").iterdir()) == []


@pytest.mark.parametrize(
    ("name", "hint"),
    [
        ("", "a letter first"),
        ("My-Robot", "did you mean 'my_robot'?"),
        ("MyRobot", "did you mean 'my_robot'?"),
        ("_my__robot_", "did you mean 'my_robot'?"),
        ("0robot", "a letter first"),
        ("robot\n", "did you mean 'robot'?"),
        ("röbot", "write lowercase letters"),
        ("class", "a word of Python's own"),
        ("a" * (MAX_NAME_LENGTH + 1), f"at most {MAX_NAME_LENGTH} characters"),
    ],
)
@pytest.mark.parametrize("kind", ["package", "node"])
def test_names_that_cannot_be(kind: str, name: str, hint: str) -> None:
    """For packages as for nodes: one line says which name and what to write."""
    with pytest.raises(InvalidPackageError) as error:
        new(name) if kind == "package" else new(node_name=name)
    text = str(error.value)
    assert text.startswith(f"Invalid {kind} name '")
    assert hint in text
    assert "\n" not in text


@pytest.mark.parametrize("name", ["test", "tests", "random", "actors", "proto", "msgspec"])
def test_packages_that_would_hide_another(name: str) -> None:
    """Python's, callboard's, or the package's own tests; a node in a package hides nothing."""
    with pytest.raises(InvalidPackageError, match=f"packages can't be named '{name}'"):
        new(name)
    assert new(node_name=name).node_name == name


@pytest.mark.parametrize("name", ["callboard", "python", "pip"])
def test_nodes_whose_program_would_replace_another(name: str) -> None:
    """Programs of all packages are in one folder."""
    with pytest.raises(InvalidPackageError, match=f"nodes can't be named '{name}'"):
        new(node_name=name)


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("description", "two\nlines"),
        ("description", ""),
        ("license_name", "MIT\x1b[2J"),
        ("maintainer_name", "\ud800"),
        ("maintainer_email", "nobody"),
        ("maintainer_email", "a b@example.org"),
        ("maintainer_email", "root@localhost"),
        ("dependencies", ("",)),
        ("dependencies", ("--index-url",)),
        ("dependencies", ("x; rm",)),
        ("dependencies", ("numpy\n",)),
        ("dependencies", ("x" * 1001,)),
    ],
)
def test_texts_that_cannot_be(field: str, value: Any) -> None:
    """What would break the file, or pip, is refused in one line."""
    with pytest.raises(InvalidPackageError) as error:
        new(**{field: value})
    assert str(error.value).startswith("Invalid ")
    assert str(error.value).isprintable()


def test_ros_packages_need_no_installation() -> None:
    """rclpy and the message packages have their counterparts in callboard."""
    assert comes_with_callboard("rclpy")
    assert comes_with_callboard("std_msgs")
    assert not comes_with_callboard("numpy")


def test_suggested_names_are_valid() -> None:
    """Or there is none."""
    assert suggested_name("2D-Robot!") is None
    assert new(suggested_name("Robot2D Arm") or "").name == "robot2_d_arm"


def test_templates_are_installed_with_callboard() -> None:
    """Each is covered by what pyproject.toml says."""
    folder = Path(next(iter(actors.tools.__path__)))
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    patterns = settings["tool"]["setuptools"]["package-data"]["actors.tools"]
    covered = {path for pattern in patterns for path in folder.glob(pattern)}
    there = {path for path in (folder / "templates").rglob("*") if path.is_file()}
    assert there == covered
    assert there
