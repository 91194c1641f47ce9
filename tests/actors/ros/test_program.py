"""Programs of files and of installed packages, with their own arguments."""

from __future__ import annotations

import sys
from importlib.metadata import EntryPoint
from typing import TYPE_CHECKING, Any

import pytest

from actors.ros import program
from actors.ros.__main__ import main

if TYPE_CHECKING:
    from pathlib import Path


@pytest.fixture(autouse=True)
def _own_interpreter_state(monkeypatch: pytest.MonkeyPatch) -> None:
    """Forget what a program changes."""
    monkeypatch.setattr(sys, "meta_path", [*sys.meta_path])
    monkeypatch.setattr(sys, "path", [*sys.path])
    monkeypatch.setattr(sys, "argv", [])


def test_a_script_runs_with_its_arguments(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """As `python script.py` does: its folder is on the path, and ROS 2's names are found."""
    (tmp_path / "beside_the_script.py").write_text("NAME = 'beside'\n")
    script = tmp_path / "script.py"
    script.write_text(
        "import sys, beside_the_script, rclpy.constants\n"
        "print(__name__, sys.argv[1:], beside_the_script.NAME, rclpy.constants.S_TO_NS)\n"
    )
    monkeypatch.setattr(sys, "argv", ["ros", str(script), "--ros-args", "-r", "a:=b"])
    main()
    assert capsys.readouterr().out == "__main__ ['--ros-args', '-r', 'a:=b'] beside 1000000000\n"


class Distribution:
    """What the tests need of an installed package."""

    name = "py-pubsub"


def test_a_console_script_of_a_package_runs(monkeypatch: pytest.MonkeyPatch) -> None:
    """Its exit code is the program's; what there is not is named."""
    script = EntryPoint("talker", "platform:python_version", "console_scripts")
    vars(script).update(dist=Distribution())
    monkeypatch.setattr(program, "entry_points", lambda **group: [script])
    with pytest.raises(SystemExit) as ended:
        program.run_program("py_pubsub", ["talker", "x"])
    assert str(ended.value.code).startswith("3.")
    assert sys.argv == ["talker", "x"]
    with pytest.raises(
        program.NoProgramError, match="No program 'none' in package 'py_pubsub'; there is: talker"
    ):
        program.run_program("py_pubsub", ["none"])


@pytest.mark.parametrize(
    ("args", "text"),
    [
        (["none.py"], "No script 'none.py'"),
        (["none"], "No script 'none'"),
        (["no_such_package", "talker"], "No installed package 'no_such_package'"),
    ],
)
def test_a_mistake_is_one_line(
    args: list[str], text: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """On stderr, with the exit code of a wrong command line."""
    monkeypatch.setattr(sys, "argv", ["ros", *args])
    with pytest.raises(SystemExit) as ended:
        main()
    assert ended.value.code == 2
    printed: Any = capsys.readouterr()
    assert printed.err.startswith(text)
    assert printed.err.count("\n") == 1
