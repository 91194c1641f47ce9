"""`callboard pkg list|executables|prefix`: what is installed."""

from __future__ import annotations

import json
import subprocess
import sys
from typing import TYPE_CHECKING

import pytest

from actors.cli.main import main

if TYPE_CHECKING:
    from tests.actors.site_packages import Site


@pytest.fixture
def robot(site: Site) -> Site:
    """A package with two programs and a folder, one that only needs callboard, and one that does not."""
    site.install(
        "my_robot",
        version="1.2",
        requires=["callboard"],
        scripts=["talker = my_robot.talker:main", "listener = my_robot.listener:main"],
        files=["../../../bin/talker"],
    )
    (site.path / "my_robot").mkdir()
    (site.path / "my_robot" / "__init__.py").touch()
    site.install("my_robot_interfaces", requires=["callboard"])
    site.install("unrelated", scripts=["program = unrelated:main"])
    site.install("a_library")
    return site


def lines(capsys: pytest.CaptureFixture[str], *arguments: str) -> list[str]:
    """Run a command that is well; return what it prints."""
    assert main(["pkg", *arguments]) == 0
    printed = capsys.readouterr()
    assert not printed.err
    return printed.out.splitlines()


def test_list_names_what_uses_callboard(robot: Site, capsys: pytest.CaptureFixture[str]) -> None:
    """One name a line; with --all also what has programs."""
    usual = lines(capsys, "list")
    assert {"my_robot", "my_robot_interfaces"} <= set(usual)
    assert not {"unrelated", "a_library", "callboard"} & set(usual)
    everything = lines(capsys, "list", "--all")
    assert {*usual, "unrelated", "callboard"} <= set(everything)
    assert "a_library" not in everything


def test_list_as_json_has_versions(robot: Site, capsys: pytest.CaptureFixture[str]) -> None:
    """One document."""
    (line,) = lines(capsys, "list", "--json")
    assert {"name": "my_robot", "version": "1.2"} in json.loads(line)


def test_executables_are_listed_with_their_package(robot: Site, capsys: pytest.CaptureFixture[str]) -> None:
    """As `callboard run` takes them; without a package those of all that use callboard."""
    assert lines(capsys, "executables", "my-robot") == ["my_robot listener", "my_robot talker"]
    everything = lines(capsys, "executables")
    assert {"my_robot listener", "my_robot talker"} <= set(everything)
    assert "unrelated program" not in everything


def test_full_paths_of_executables(robot: Site, capsys: pytest.CaptureFixture[str]) -> None:
    """What has no file is reported on stderr, with what runs it."""
    assert main(["pkg", "executables", "--full-path", "my_robot"]) == 0
    printed = capsys.readouterr()
    assert printed.out == f"{robot.prefix.resolve() / 'bin' / 'talker'}\n"
    assert printed.err.endswith("callboard run my_robot listener\n")


def test_executables_as_json(robot: Site, capsys: pytest.CaptureFixture[str]) -> None:
    """A path is null where there is no file."""
    (line,) = lines(capsys, "executables", "--json", "my_robot")
    path = str(robot.prefix.resolve() / "bin" / "talker")
    assert json.loads(line) == [
        {"package": "my_robot", "executable": "listener", "path": None},
        {"package": "my_robot", "executable": "talker", "path": path},
    ]


def test_prefix_is_the_environment(robot: Site, capsys: pytest.CaptureFixture[str]) -> None:
    """And --share is the folder of the package in it."""
    prefix, share = str(robot.prefix.resolve()), str(robot.path / "my_robot")
    assert lines(capsys, "prefix", "my_robot") == [prefix]
    assert lines(capsys, "prefix", "--share", "my_robot") == [share]
    (line,) = lines(capsys, "prefix", "--json", "my_robot")
    assert json.loads(line) == {"package": "my_robot", "prefix": prefix, "share": share}


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        (["prefix", "my_robt"], "Package not found; did you mean 'my_robot'?"),
        (["prefix", "qqqqqq"], "Package not found"),
        (["prefix", "--share", "a_library"], "Package 'a_library' has no folder of its own"),
        (["executables", "my_robt"], "Package 'my_robt' not found; did you mean 'my_robot'?"),
    ],
)
def test_what_is_not_there_is_reported(
    robot: Site, capsys: pytest.CaptureFixture[str], arguments: list[str], text: str
) -> None:
    """In ROS 2's words, and 1."""
    assert main(["pkg", *arguments]) == 1
    printed = capsys.readouterr()
    assert (printed.out, printed.err) == ("", f"{text}\n")


def test_without_packages_it_says_how_to_make_one(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """On stderr; the list is empty and that is no failure."""
    monkeypatch.setattr("actors.tools.executables.packages", list)
    for verb in ("list", "executables"):
        assert main(["pkg", verb]) == 0
        printed = capsys.readouterr()
        assert printed.out == ""
        assert "callboard pkg create" in printed.err


def test_listing_loads_nothing_heavy() -> None:
    """Neither a loop, nor types, nor packages."""
    code = (
        "import sys; from actors.cli.main import main; main(['pkg', 'list']);"
        "print([m for m in ('asyncio', 'msgspec', 'msgpack', 'yaml', 'actors.node') if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines()[-1] == "[]"
