"""`callboard run`: what this process becomes."""

from __future__ import annotations

import os
import sys
from typing import TYPE_CHECKING

import pytest

from actors.cli.main import main
from tests.actors.site_packages import Site

if TYPE_CHECKING:
    from pathlib import Path


class BecameError(Exception):
    """Stands for the end of this program."""

    def __init__(self, arguments: list[str]) -> None:
        super().__init__(arguments)
        self.arguments = arguments


@pytest.fixture(autouse=True)
def _no_exec(monkeypatch: pytest.MonkeyPatch) -> None:
    def execvp(program: str, arguments: list[str]) -> None:
        assert program == arguments[0]
        raise BecameError(arguments)

    monkeypatch.setattr(os, "execvp", execvp)
    for name in ("CALLBOARD_URL", "CALLBOARD_DOMAIN"):
        monkeypatch.setenv(name, "")  # so that what the command sets is taken back


def became(*arguments: str) -> list[str]:
    """Run `callboard run` and return the arguments that Python gets."""
    program, *rest = started(*arguments)
    assert program == sys.executable
    return rest


def started(*arguments: str) -> list[str]:
    """Run `callboard run` and return the command line that it ends in."""
    with pytest.raises(BecameError) as end:
        main(["run", *arguments])
    return end.value.arguments


def test_a_script_gets_all_that_follows(tmp_path: Path) -> None:
    """Unbuffered, with options and every -- untouched."""
    script = tmp_path / "node.py"
    script.touch()
    arguments = ["--url", "x", "--help", "--", "--ros-args", "-r", "a:=b", "--", "-1"]
    assert became(str(script), *arguments) == ["-u", str(script), *arguments]


def test_the_broker_is_told_by_the_environment(tmp_path: Path) -> None:
    """--url and --domain before the script."""
    script = tmp_path / "node.py"
    script.touch()
    became("--url", "callboard://h:1", "--domain", "7", str(script))
    assert (os.environ["CALLBOARD_URL"], os.environ["CALLBOARD_DOMAIN"]) == ("callboard://h:1", "7")


def test_an_installed_program_is_started_as_its_script_would() -> None:
    """PACKAGE EXECUTABLE runs the console script's entry point, without the current directory on the path."""
    unbuffered, safe, flag, code, *rest = became("callboard", "callboard", "--version")
    assert (unbuffered, safe, flag, rest) == ("-u", "-P", "-c", ["--version"])
    assert "from actors.cli.main import main; sys.argv[0] = 'callboard'; sys.exit(main())" in code


@pytest.mark.parametrize("as_package", [False, True])
def test_a_program_that_imports_rclpy_gets_a_hint(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    *,
    as_package: bool,
) -> None:
    """It is started all the same; a script that brings its own rclpy gets none."""
    monkeypatch.delitem(sys.modules, "rclpy", raising=False)  # the face's, if other tests imported it
    if as_package:
        site = Site(tmp_path)
        site.install("py_pubsub", scripts=["talker = py_pubsub.talker:main"])
        monkeypatch.syspath_prepend(str(site.path))
        script, words = site.path / "py_pubsub" / "talker.py", ["py_pubsub", "talker"]
        script.parent.mkdir()
        (script.parent / "__init__.py").write_text("raise AssertionError  # it is not imported")
    else:
        script = tmp_path / "talker.py"
        words = [str(script)]
    script.write_text("import sys\nimport rclpy.node\n")
    became(*words)
    assert capsys.readouterr().err == (
        f"WARNING: {script} imports rclpy, which is not installed; to run it with callboard's:"
        f" callboard run --ros {' '.join(words)}\n"
    )
    (script.parent / "rclpy.py").touch()
    became(*words)
    assert not capsys.readouterr().err


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="needs named pipes")
def test_a_named_pipe_in_a_package_is_not_searched_for_imports(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Case 86: reading it would never end; Python says that there is no such module."""
    site = Site(tmp_path)
    site.install("py_pubsub", scripts=["talker = py_pubsub.talker:main"])
    monkeypatch.syspath_prepend(str(site.path))
    (site.path / "py_pubsub").mkdir()
    (site.path / "py_pubsub" / "__init__.py").touch()
    os.mkfifo(site.path / "py_pubsub" / "talker.py")
    assert "py_pubsub.talker" in became("py_pubsub", "talker")[-1]


def test_a_program_for_ros_is_run_by_its_module(capsys: pytest.CaptureFixture[str]) -> None:
    """A folder "actors" here is not taken for it. The options of --ros are passed on, and need it."""
    module = ["-u", "-P", "-m", "actors.ros"]
    assert became("--ros", "talker.py", "-x") == [*module, "talker.py", "-x"]
    flags = ["--force", "--no-broker"]
    assert became("--ros", *flags, "a", "b") == [*module, *flags, "a", "b"]
    for flag in flags:
        assert main(["run", flag, "a.py"]) == 2
        assert capsys.readouterr().err == f"{flag} needs --ros\n"


def test_a_prefix_starts_the_program(tmp_path: Path) -> None:
    """It is split as a shell would, and Python with the script follows."""
    script = tmp_path / "node.py"
    script.touch()
    debugger = ["gdb", "-ex", "run now", "--args"]
    command = started("--prefix", "gdb -ex 'run now' --args", str(script), "-x")
    assert command == [*debugger, sys.executable, "-u", str(script), "-x"]


@pytest.mark.parametrize(
    ("prefix", "code", "text"),
    [
        ("gdb 'run", 2, "--prefix 'gdb 'run' is not a command: No closing quotation\n"),
        ("no-such-debugger", 1, "No command 'no-such-debugger'\n"),
    ],
)
def test_a_prefix_that_cannot_be_is_named(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], prefix: str, code: int, text: str
) -> None:
    """A quote too few is a usage error; a command that is not there is a failure."""

    def execvp(program: str, arguments: list[str]) -> None:
        raise FileNotFoundError

    monkeypatch.setattr(os, "execvp", execvp)
    assert main(["run", "--prefix", prefix, "callboard", "callboard"]) == code
    assert capsys.readouterr().err == text


@pytest.mark.parametrize(
    ("place", "package", "remedy"),
    [(".", "My-Robot", "pip install -e ./My-Robot"), ("my-robot", "my_robot", "pip install -e .")],
)
def test_a_package_that_is_only_here_has_to_be_installed(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    place: str,
    package: str,
    remedy: str,
) -> None:
    """Its source beside or around the caller is noticed."""
    for folder in ("My-Robot", "my-robot"):
        (tmp_path / folder).mkdir(exist_ok=True)
        (tmp_path / folder / "pyproject.toml").touch()
    monkeypatch.chdir(tmp_path / place)
    assert main(["run", package, "talker"]) == 1
    expected = f"No script and no installed package '{package}'; install it with: {remedy}\n"
    assert capsys.readouterr().err == expected


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        (["nod.py"], "No script 'nod.py'; did you mean 'node.py'?"),
        (["elsewhere/node.py"], "No script 'elsewhere/node.py'"),
        (["node"], "No script and no installed package 'node'; did you mean './node.py'?"),
        (["calboard"], "No script and no installed package 'calboard'; did you mean 'callboard'?"),
        (["callboard"], "Which program of 'callboard'? There is: callboard"),
        (
            ["callboard", "calboard"],
            "No program 'calboard' in package 'callboard'; did you mean 'callboard'?",
        ),
        (["msgpack", "x"], "Package 'msgpack' has no console scripts to run"),
    ],
)
def test_what_is_not_there_is_named(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    arguments: list[str],
    text: str,
) -> None:
    """One line with a remedy, and 1."""
    (tmp_path / "node.py").touch()
    monkeypatch.chdir(tmp_path)
    assert main(["run", *arguments]) == 1
    assert capsys.readouterr().err == f"{text}\n"


def test_a_bad_url_is_found_before_the_script_starts(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """It is a usage error here."""
    assert main(["run", "--url", "nonsense", str(tmp_path)]) == 2
    assert "'nonsense'" in capsys.readouterr().err
