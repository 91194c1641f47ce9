"""What is installed, as its metadata says it."""

from __future__ import annotations

import sys
import textwrap
from typing import TYPE_CHECKING

import pytest

from actors.tools.executables import Executable, Package, find_package, normalized, packages
from tests.actors.site_packages import Site

if TYPE_CHECKING:
    from pathlib import Path


def found(name: str) -> Package:
    """Return a package that is there."""
    package = find_package(name)
    assert package is not None
    return package


@pytest.mark.parametrize("spelling", ["my_robot", "my-robot", "My.Robot"])
def test_every_spelling_of_a_name_finds_it(site: Site, spelling: str) -> None:
    """As for pip; its name is as its author has written it."""
    site.install("my_robot", version="1.2")
    package = found(spelling)
    assert (package.name, package.version) == ("my_robot", "1.2")
    assert normalized(spelling) == "my-robot"


@pytest.mark.parametrize("name", ["no_such_package", "", " "])
def test_what_is_not_installed_is_not_found(name: str) -> None:
    """Also what cannot be a name."""
    assert find_package(name) is None


@pytest.mark.parametrize(
    ("requirement", "uses"),
    [
        ("callboard", True),
        ("Callboard[testing]>=0.1; python_version>='3.11'", True),
        ('callboard; extra == "robot"', False),
        ("callboard-extras", False),
        ("msgpack", False),
    ],
)
def test_callboard_packages_are_those_that_need_it(site: Site, requirement: str, uses: bool) -> None:
    """In whatever version and spelling, but not for an extra only."""
    site.install("my_robot", requires=["msgpack", requirement])
    assert found("my_robot").uses_callboard is uses


def test_executables_are_console_scripts(site: Site) -> None:
    """By name, with the file that the installer has written."""
    site.install(
        "my_robot",
        scripts=["talker = my_robot.talker:main", "echo = my_robot.nodes:Echo.main [fast]"],
        files=["../../../bin/talker", "my_robot/talker.py"],
    )
    package = found("my-robot")
    assert package.executables() == [
        Executable("my_robot", "echo", "my_robot.nodes", "Echo.main", None),
        Executable("my_robot", "talker", "my_robot.talker", "main", site.prefix.resolve() / "bin" / "talker"),
    ]
    assert package.executable("talker") == package.executables()[1]
    assert package.executable("listener") is None


def test_a_program_of_a_target_folder_is_there(site: Site) -> None:
    """pip records it as if the folder were site-packages."""
    site.install("my_robot", scripts=["talker = my_robot.talker:main"], files=["../../bin/talker"])
    (site.prefix / "bin").mkdir()
    (site.prefix / "bin" / "talker").touch()
    program = found("my_robot").executable("talker")
    assert program is not None
    assert program.path == site.prefix.resolve() / "bin" / "talker"


def test_a_command_does_what_the_script_does(
    site: Site, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """It calls the function, named as the script, and ends with what that returns."""
    site.install("my_robot", scripts=["echo = my_robot_nodes:Echo.main"])
    source = """
        import sys
        class Echo:
            @staticmethod
            def main():
                print(sys.argv)
                return 3
    """
    (site.path / "my_robot_nodes.py").write_text(textwrap.dedent(source))
    executable = found("my_robot").executable("echo")
    assert executable is not None
    monkeypatch.setattr(sys, "argv", ["-c", "--fast"])
    with pytest.raises(SystemExit) as end:
        exec(executable.command(), {})
    assert end.value.code == 3
    assert capsys.readouterr().out == "['echo', '--fast']\n"


def test_a_list_has_each_package_once(site: Site, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The one that Python imports hides another of its name; what has no name is passed over."""
    other = Site(tmp_path / "later")
    monkeypatch.syspath_prepend(str(other.path))
    site.install("my_robot", version="1.0")
    other.install("my-robot", version="2.0")
    site.install("a_robot")
    (site.path / "broken-1.0.dist-info").mkdir()
    listed = [(each.name, each.version) for each in packages()]
    assert [each for each in listed if "robot" in each[0]] == [("a_robot", "1.0"), ("my-robot", "2.0")]
    names = [normalized(name) for name, _ in listed]
    assert names == sorted(set(names))
    assert {"callboard", "msgpack"} <= set(names)


def test_a_package_knows_its_environment(site: Site) -> None:
    """The folder above lib, and beyond a site-packages the folder of the package itself."""
    site.install("my_robot")
    assert found("my_robot").prefix() == site.prefix.resolve()


def test_a_package_beside_its_source_has_that_as_its_prefix(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As what an old editable installation leaves behind."""
    info = tmp_path / "my_robot.egg-info"
    info.mkdir()
    (info / "PKG-INFO").write_text("Metadata-Version: 2.1\nName: my_robot\nVersion: 1.0\n")
    (info / "requires.txt").write_text("callboard\n")
    monkeypatch.syspath_prepend(str(tmp_path))
    assert found("my_robot").prefix() == tmp_path.resolve()
    assert found("my_robot").uses_callboard


def test_a_package_shares_the_folder_of_its_modules(site: Site) -> None:
    """Found by its own name, else by what its metadata says; one without a folder has None."""
    site.install("my-robot")
    (site.path / "my_robot").mkdir()
    (site.path / "my_robot" / "__init__.py").touch()
    assert found("my-robot").share() == site.path / "my_robot"
    info = site.install("renamed")
    (info / "top_level.txt").write_text("a_module_of_it\nmy_robot\n")
    (site.path / "a_module_of_it.py").touch()
    assert found("renamed").share() == site.path / "my_robot"
    site.install("no-folder")
    assert found("no-folder").share() is None


def test_a_package_consists_of_the_modules_that_python_finds(
    site: Site, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its own, those it lists, those with its programs; of an editable installation where they are."""
    elsewhere = tmp_path / "elsewhere"
    (elsewhere / "my_robot").mkdir(parents=True)
    (elsewhere / "my_robot" / "__init__.py").touch()
    (elsewhere / "robot_tool.py").touch()
    monkeypatch.syspath_prepend(str(elsewhere))
    info = site.install("my-robot", scripts=["tool = robot_tool:main", "talker = my_robot.talker:main"])
    (info / "top_level.txt").write_text("my_robot\nno_such_module\n")
    assert found("my-robot").modules() == [elsewhere / "my_robot", elsewhere / "robot_tool.py"]
    site.install("bare")
    assert found("bare").modules() == []
