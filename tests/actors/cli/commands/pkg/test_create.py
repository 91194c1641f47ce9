"""`callboard pkg create`: what it says, and what is there then."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from actors.cli.main import main

ADA = ("--maintainer-name", "Ada", "--maintainer-email", "ada@example.org")


@pytest.fixture(autouse=True)
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty current directory."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_it_says_what_ros_2_says(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A summary, then each folder and file that is new."""
    options = ["--node-name", "talker", "--license", "Apache-2.0", "--description", "Talks", *ADA]
    assert main(["pkg", "create", "my_robot", "--build-type", "ament_python", *options]) == 0
    printed = capsys.readouterr()
    assert printed.out.splitlines() == [
        "going to create a new package",
        "package name: my_robot",
        f"destination directory: {here.resolve()}",
        "package format: pyproject.toml",
        "version: 0.0.0",
        "description: Talks",
        "maintainer: ['Ada <ada@example.org>']",
        "licenses: ['Apache-2.0']",
        "build type: ament_python",
        "dependencies: []",
        "node_name: talker",
        "creating folder ./my_robot",
        "creating ./my_robot/pyproject.toml",
        "creating ./my_robot/README.md",
        "creating ./my_robot/.gitignore",
        "creating ./my_robot/LICENSE",
        "creating folder ./my_robot/my_robot",
        "creating ./my_robot/my_robot/__init__.py",
        "creating ./my_robot/my_robot/talker.py",
        "creating folder ./my_robot/my_robot/launch",
        "creating ./my_robot/my_robot/launch/README.md",
        "creating folder ./my_robot/tests",
        "creating ./my_robot/tests/test_talker.py",
    ]
    assert printed.err == "\nNow install it: pip install -e ./my_robot\n"
    assert (here / "my_robot" / "LICENSE").is_file()


def test_a_folder_that_exists_is_left_alone(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """ROS 2's text on stderr, nothing on stdout, and 1."""
    (here / "my_robot").mkdir()
    assert main(["pkg", "create", "my_robot"]) == 1
    printed = capsys.readouterr()
    assert printed.out == ""
    assert printed.err == (
        "\nAborted!\nThe directory already exists: ./my_robot\n"
        "Either remove the directory or choose a different destination directory or package name\n"
    )
    assert list((here / "my_robot").iterdir()) == []


def test_a_link_to_nowhere_is_there_too(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """It is not written through."""
    (here / "my_robot").symlink_to(here / "elsewhere")
    assert main(["pkg", "create", "my_robot"]) == 1
    assert "already exists" in capsys.readouterr().err


def test_without_a_license_there_is_a_warning(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """It names those that come with their text."""
    assert main(["pkg", "create", "my_robot"]) == 0
    err = capsys.readouterr().err
    assert "[WARNING]: Unknown license 'TODO: License declaration'." in err
    assert "\nApache-2.0\nBSD-3-Clause\nMIT\n" in err


def test_licenses_are_listed(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Nothing is made then."""
    assert main(["pkg", "create", "my_robot", "--license", "?"]) == 0
    assert capsys.readouterr().out == "Supported licenses:\nApache-2.0\nBSD-3-Clause\nMIT\n"
    assert list(here.iterdir()) == []


def test_what_callboard_brings_is_no_dependency(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Course texts name rclpy and std_msgs, which pip does not have."""
    dependencies = ["--dependencies", "rclpy", "std_msgs", "numpy"]
    assert main(["pkg", "create", "my_robot", *dependencies]) == 0
    printed = capsys.readouterr()
    assert "dependencies: ['rclpy', 'std_msgs', 'numpy']\n" in printed.out
    assert "Nothing is to be installed for rclpy, std_msgs" in printed.err
    text = (here / "my_robot" / "pyproject.toml").read_text(encoding="utf-8")
    assert 'dependencies = ["callboard", "numpy"]\n' in text


def test_json_says_which_files(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """One document, and warnings on stderr as ever."""
    arguments = ["my_robot", "--destination-directory", "new/src", "--json"]
    assert main(["pkg", "create", *arguments]) == 0
    printed = capsys.readouterr()
    made = json.loads(printed.out)
    assert (made["package"], made["directory"]) == ("my_robot", str(here / "new" / "src" / "my_robot"))
    assert "my_robot/__init__.py" in made["files"]
    assert all((Path(made["directory"]) / path).is_file() for path in made["files"])
    assert "[WARNING]" in printed.err


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        (["My-Robot"], "Invalid package name 'My-Robot'"),
        (["my_robot", "--node-name", "Talker"], "did you mean 'talker'?"),
        (["my_robot", "--maintainer-email", "nobody"], "Invalid email address 'nobody'"),
        (["my_robot", "--build-type", "ament_cmake"], "no --build-type 'ament_cmake'"),
        (["--node-name", "talker"], "NAME"),
    ],
)
def test_what_cannot_be_is_a_usage_error(
    here: Path, capsys: pytest.CaptureFixture[str], arguments: list[str], text: str
) -> None:
    """One line, 2, and nothing is written."""
    assert main(["pkg", "create", *arguments]) == 2
    printed = capsys.readouterr()
    assert printed.out == ""
    assert text in printed.err
    assert printed.err.count("\n") == 1
    assert list(here.iterdir()) == []
