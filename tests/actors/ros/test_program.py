"""Programs of files and of installed packages, with their own arguments."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING, Any
from unittest.mock import Mock

import pytest

from actors.processes import local_broker
from actors.ros import program
from actors.ros.__main__ import main
from actors.tools.executables import Executable
from actors.tools.programs import NoProgramError
from proto.aio import process

if TYPE_CHECKING:
    from pathlib import Path


@pytest.fixture(autouse=True)
def configured(monkeypatch: pytest.MonkeyPatch) -> Mock:
    """Stands for the configuration of the process, which would be that of the tests."""
    configured = Mock()
    monkeypatch.setattr(process, "configure_process", configured)
    return configured


@pytest.fixture(autouse=True)
def _own_interpreter_state(monkeypatch: pytest.MonkeyPatch) -> None:
    """Forget what a program changes."""
    monkeypatch.setattr(sys, "meta_path", [*sys.meta_path])
    monkeypatch.setattr(sys, "path", [*sys.path])
    monkeypatch.setattr(sys, "argv", [])
    monkeypatch.setenv("CALLBOARD_URL", "callboard://192.0.2.1:7411")  # elsewhere: no broker is started


def test_the_process_is_configured_before_the_program_runs(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, configured: Mock
) -> None:
    """Once: it is the program's own, and large messages take half of the time with memory that is kept."""
    script = tmp_path / "script.py"
    script.write_text("raise SystemExit(7)\n")
    monkeypatch.setattr(sys, "argv", ["ros", str(script)])
    with pytest.raises(SystemExit, match="7"):
        main()
    configured.assert_called_once_with()


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


def test_a_folder_and_a_module_run_as_with_python(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """A folder's `__main__.py`; `-m` finds modules in the folder where it was started."""
    (tmp_path / "beside_it.py").write_text("import sys\nprint(__name__, sys.argv[1:])\n")
    (tmp_path / "__main__.py").write_text("import beside_it\nprint(__name__)\n")
    monkeypatch.setattr(sys, "argv", ["ros", str(tmp_path)])
    main()
    assert capsys.readouterr().out == "beside_it []\n__main__\n"
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "argv", ["ros", "-m", "beside_it", "-x"])
    main()
    assert capsys.readouterr().out == "__main__ ['-x']\n"


@pytest.mark.processes
def test_a_broker_is_started_unless_it_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """One line on stderr says so; if it cannot be started, the program does not run, and the code is 1."""
    (tmp_path / "script.py").write_text("print('runs')\n")
    asked: list[object] = []
    kept: list[object] = []

    def ensure(target: object) -> str:
        asked.append(target)
        return "Started"

    with monkeypatch.context() as patch:
        patch.setattr(local_broker, "ensure_local_broker", ensure)
        patch.setattr(local_broker, "keep_local_broker", kept.append)
        for flags, said in ((["--no-broker"], ""), ([], "Started\n")):
            patch.setattr(sys, "argv", ["ros", *flags, str(tmp_path / "script.py")])
            main()
            assert capsys.readouterr() == ("runs\n", said)
    assert len(asked) == 1
    assert kept == asked
    monkeypatch.setenv("CALLBOARD_URL", f"callboard+unix://{tmp_path}/none/s")
    monkeypatch.setattr(sys, "argv", ["ros", str(tmp_path / "script.py")])
    with pytest.raises(SystemExit) as ended:
        main()
    assert ended.value.code == 1
    printed = capsys.readouterr()
    assert printed.out == ""
    assert printed.err.startswith("Cannot start a broker at callboard+unix://")


def test_an_executable_of_a_package_runs(monkeypatch: pytest.MonkeyPatch) -> None:
    """Its exit code is the program's; what there is not is named."""
    talker = Executable("py-pubsub", "talker", "platform", "python_version", None)
    monkeypatch.setattr(program, "find_executable", lambda package, arguments: talker)
    with pytest.raises(SystemExit) as ended:
        program.find_program("py_pubsub", ["talker", "x"])()
    assert str(ended.value.code).startswith("3.")
    assert sys.argv == ["talker", "x"]


def test_a_package_has_any_spelling() -> None:
    """As for `callboard run`."""
    with pytest.raises(NoProgramError, match="No program 'none' in package 'CallBoard'; there is: callboard"):
        program.find_program("CallBoard", ["none"])


def test_a_missing_dependency_is_not_a_missing_module(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The error is that of the import that fails."""
    (tmp_path / "needs_more").mkdir()
    (tmp_path / "needs_more" / "__init__.py").write_text("import no_such_dependency\n")
    (tmp_path / "needs_more" / "talker.py").touch()
    monkeypatch.syspath_prepend(tmp_path)
    with pytest.raises(ModuleNotFoundError, match="no_such_dependency"):
        program.find_program("needs_more.talker", [], module=True)


def test_ctrl_c_before_the_program_runs_has_no_traceback(monkeypatch: pytest.MonkeyPatch) -> None:
    """The exit code is that of SIGINT."""

    def interrupt(**options: bool) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("actors.ros.finder.install", interrupt)
    monkeypatch.setattr(sys, "argv", ["ros", "script.py"])
    with pytest.raises(SystemExit) as ended:
        main()
    assert ended.value.code == 130


@pytest.mark.parametrize(
    ("args", "text"),
    [
        (["none.py"], "No script 'none.py'"),
        (["none"], "No script and no installed package 'none'; write SCRIPT.py [ARGS], or"),
        (["calboard", "talker"], "No script and no installed package 'calboard'; did you mean 'callboard'?"),
        (["callboard"], "Which program of 'callboard'? There is: callboard"),
        (["-m", "none"], "No module 'none'"),
        (["-m", "none.below"], "No module 'none.below'"),
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
