"""`callboard pkg list|executables|prefix|xml`: what is installed."""

from __future__ import annotations

import json
import subprocess
import sys
from typing import TYPE_CHECKING

import pytest

from actors.cli.main import main

if TYPE_CHECKING:
    from pathlib import Path

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


@pytest.mark.processes
def test_listing_loads_nothing_heavy() -> None:
    """Neither a loop, nor types, nor packages."""
    code = (
        "import sys; from actors.cli.main import main; main(['pkg', 'list']);"
        "print([m for m in ('asyncio', 'msgspec', 'msgpack', 'yaml', 'actors.node') if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines()[-1] == "[]"


@pytest.fixture
def ros_package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A package of ROS 2 with one program, in a prefix of its own; return its share folder."""
    index = tmp_path / "share" / "ament_index" / "resource_index" / "packages"
    share, programs = tmp_path / "share" / "arm_driver", tmp_path / "lib" / "arm_driver"
    for folder in (index, share, programs):
        folder.mkdir(parents=True)
    (index / "arm_driver").touch()
    (share / "package.xml").write_text(
        "<package format='3'><name>arm_driver</name><version>1.2.3</version>"
        "<author>A</author><author>B</author>"
        "<export><build_type>ament_python</build_type></export></package>",
        encoding="utf-8",
    )
    (programs / "arm").write_text("#!/usr/bin/env python3\n", encoding="utf-8")
    (programs / "arm").chmod(0o755)
    monkeypatch.setenv("AMENT_PREFIX_PATH", str(tmp_path))
    return share


@pytest.mark.usefixtures("ros_package")
def test_xml(capsys: pytest.CaptureFixture[str]) -> None:
    """The manifest in ROS 2's form, or what a tag says, one text a line."""
    assert lines(capsys, "xml", "arm_driver", "-t", "version") == ["1.2.3"]
    assert lines(capsys, "xml", "arm_driver", "--tag", "author") == ["A", "B"]
    assert lines(capsys, "xml", "arm_driver", "--tag", "export/build_type") == ["ament_python"]
    (whole,) = lines(capsys, "xml", "arm_driver")
    assert whole.startswith('<package format="3"><name>arm_driver</name>')
    assert json.loads(lines(capsys, "xml", "arm_driver", "-t", "author", "--json")[0])["texts"] == ["A", "B"]


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        (["arm_drivr"], "Package not found; did you mean 'arm_driver'?\n"),
        (["arm_driver", "-t", "nothing"], "XML tag not found\n"),
        (["arm_driver", "-t", "["], "XML tag not found\n"),
        (["pytest"], "Package XML manifest not found: 'pytest' is no package of ROS 2; pip show pytest"),
    ],
)
@pytest.mark.usefixtures("ros_package")
def test_xml_that_is_not_there(capsys: pytest.CaptureFixture[str], arguments: list[str], text: str) -> None:
    """ROS 2's texts, with what may have been meant, or where else to look."""
    assert main(["pkg", "xml", *arguments]) == 1
    assert capsys.readouterr().err.startswith(text)


def test_xml_of_a_broken_file(ros_package: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """It is named."""
    (ros_package / "package.xml").write_text("<package", encoding="utf-8")
    assert main(["pkg", "xml", "arm_driver"]) == 1
    assert capsys.readouterr().err.startswith(f"{ros_package / 'package.xml'} is not XML: ")


@pytest.mark.usefixtures("ros_package")
def test_executables_of_all_packages_that_are_listed(capsys: pytest.CaptureFixture[str]) -> None:
    """Those of packages of ROS 2, too, as `pkg list` lists these."""
    assert "arm_driver" in lines(capsys, "list")
    assert "arm_driver arm" in lines(capsys, "executables")
