"""What this machine has: files, packages, programs."""

from __future__ import annotations

import gc
import os
import sys
import threading
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from actors.launch.description.actions import LogInfo
from actors.launch.description.description import LaunchDescription
from actors.launch.errors import LaunchError, LaunchFileError
from actors.launch.resources import files as module
from actors.launch.resources.files import MAX_FILE_BYTES, Files
from actors.tools.executables import find_package

if TYPE_CHECKING:
    from collections.abc import Callable

    from tests.actors.site_packages import Site

FILES = Files()


def test_a_description_knows_its_file(tmp_path: Path) -> None:
    """Whatever the file's function says about that."""
    path = tmp_path / "f.py"
    path.write_text(
        "from actors.launch import LaunchDescription\n"
        "generate_launch_description = lambda: LaunchDescription(file='x')"
    )
    assert FILES.description(str(path)).file == str(path)


def test_the_files_that_were_read_are_known(tmp_path: Path) -> None:
    """Each once, also one that turned out to be wrong: mending it is a change."""
    files = Files()
    path = str(tmp_path / "a.launch.py")
    for _ in range(2):
        with pytest.raises(LaunchFileError):
            files.description(path)
    assert files.launch_files == [path]


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="needs named pipes")
@pytest.mark.parametrize("suffix", ["py", "yaml"])
def test_a_named_pipe_is_no_launch_file_to_include(tmp_path: Path, suffix: str) -> None:
    """Case 86: it would be waited for. The first file is the user's, who may mean a pipe."""
    pipe = tmp_path / f"pipe.{suffix}"
    os.mkfifo(pipe)
    files = Files()
    text = "from actors.launch import LaunchDescription as generate_launch_description"
    writer = threading.Thread(target=pipe.write_text, args=(text if suffix == "py" else "launch: []",))
    writer.start()
    assert files.description(str(pipe)).file == str(pipe)
    writer.join()
    files.launch_files.insert(0, str(tmp_path / "includes.py"))
    with pytest.raises(LaunchFileError, match=f"No launch file '{pipe}': not a regular file"):
        files.description(str(pipe))
    pipe.unlink()  # Hypothesis reads the files of all modules


def test_a_package_has_sources_and_data(site: Site) -> None:
    """The folders of its modules; a module may be a file, too."""
    site.install("my-robot", scripts=["talker = my_robot.talker:main", "tool = robot_tool:main"])
    (site.path / "my_robot").mkdir()
    (site.path / "my_robot" / "__init__.py").touch()
    (site.path / "robot_tool.py").touch()
    folder = str(site.path / "my_robot")
    assert FILES.share("my_robot") == folder
    assert FILES.sources(package="my_robot") == (folder, str(site.path / "robot_tool.py"))


def test_a_scripts_sources_are_in_its_folder(tmp_path: Path) -> None:
    """The one that Python finds its modules in: of the file that a link leads to."""
    (tmp_path / "scripts").mkdir()
    (tmp_path / "scripts" / "a.py").touch()
    (tmp_path / "link.py").symlink_to(tmp_path / "scripts" / "a.py")
    assert FILES.sources(script=str(tmp_path / "link.py")) == (str((tmp_path / "scripts").resolve()),)


def test_a_program_is_found_along_the_path_that_is_given(tmp_path: Path) -> None:
    """Not along this process's own."""
    program = tmp_path / "robot-tool"
    program.write_text('#!/bin/sh\necho "$1, $ROBOT"\n')
    program.chmod(0o755)
    environment = {"PATH": f"/none:{tmp_path}", "ROBOT": "r2"}
    assert FILES.executable("robot-tool", environment) == str(program)
    assert FILES.output_of(["robot-tool", "a b"], environment) == "a b, r2\n"
    assert FILES.output_of([str(program), "c"], {}) == "c, \n"


def test_a_text_file_is_read_as_utf_8(tmp_path: Path) -> None:
    """Up to its limit."""
    path = tmp_path / "text"
    path.write_bytes("é\r\n".encode())
    assert FILES.text(str(path)) == "é\r\n"
    path.write_bytes(b"a" * MAX_FILE_BYTES)
    assert len(FILES.text(str(path))) == MAX_FILE_BYTES


def test_words_that_nobody_else_has_can_be_in_names() -> None:
    """They differ, also from those of other processes."""
    first, second = FILES.unique(), FILES.unique()
    assert first != second
    assert first.startswith(f"{os.getpid()}_")
    assert first.isascii()
    assert first.isidentifier() or f"a_{first}".isidentifier()


@pytest.mark.parametrize(
    ("question", "error"),
    [
        (lambda _: FILES.share("no-such-package"), "No installed package 'no-such-package'"),
        (lambda _: FILES.sources(package="no-such-package"), "No installed package"),
        (lambda _: FILES.program("no-such-package", "x"), "No installed package"),
        (lambda _: FILES.share("bare"), "Package 'bare' has no folder"),
        (lambda _: FILES.executable("python3", {"PATH": ""}), "No program 'python3'"),
        (lambda _: FILES.output_of([], {}), "An empty string is not a command"),
        (lambda _: FILES.output_of(["no-such-program"], {}), "No program 'no-such-program'"),
        (
            lambda _: FILES.output_of([sys.executable, "-c", "import sys; sys.exit('no')"], {}),
            "has failed with exit code 1: no",
        ),
        (lambda folder: FILES.text(str(folder / "none")), "none': No such file or directory"),
        (lambda folder: FILES.text("a\0b"), "No file 'a.x00b': embedded null byte"),
        (lambda folder: FILES.text(str(folder / "binary")), "binary is not UTF-8"),
        (lambda folder: FILES.text(str(folder / "large")), f"large is larger than {MAX_FILE_BYTES} bytes"),
    ],
)
def test_what_is_not_there_is_an_error(
    question: Callable[[Path], object], error: str, site: Site, tmp_path: Path
) -> None:
    """Which says what is missing."""
    site.install("bare")
    (tmp_path / "binary").write_bytes(b"\xff")
    (tmp_path / "large").write_bytes(b"a" * (MAX_FILE_BYTES + 1))
    with pytest.raises(LaunchError, match=error):
        question(tmp_path)


def test_a_temporary_file_exists_as_long_as_the_library() -> None:
    """Two of one name are two files."""
    files = Files()
    first, second = (files.temporary_file("p.yaml", text) for text in ("a: 1", "a: 2"))
    assert [Path(each).read_text(encoding="utf-8") for each in (first, second)] == ["a: 1", "a: 2"]
    assert Path(first).name == "p.yaml"
    del files
    gc.collect()  # its caches refer to it
    assert not Path(first).exists()


def test_the_log_folder_of_a_launch_is_created_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Substitutions and log files have the same one."""
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    files = Files()
    folder = files.log_folder()
    assert folder == files.log_folder() == str(files.open_log_folder().path)
    assert Path(folder).parent == tmp_path / "callboard" / "log"
    files.open_log_folder().close()
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "file"))
    (tmp_path / "file").touch()
    with pytest.raises(LaunchError, match=r"The folder for log files cannot be created: .*Not a directory"):
        Files().log_folder()


def test_a_launch_files_name_says_its_language(tmp_path: Path) -> None:
    """Each language gives the same description; each file has the same limit."""
    sources = {
        "a.launch.py": "from actors.launch import LaunchDescription, LogInfo\n"
        "def generate_launch_description(): return LaunchDescription([LogInfo(msg='hello')])",
        "a.launch.yaml": "launch: [{log: {message: hello}}]",
        "a.launch.yml": "launch:\n- log:\n    message: hello",
        "a.launch.xml": "<launch><log message='hello'/></launch>",
        "a.launch.toml": "[[launch]]\nlog.message = 'hello'",
    }
    for name, source in sources.items():
        path = tmp_path / name
        path.write_text(source)
        assert FILES.description(str(path)) == LaunchDescription((LogInfo(msg="hello"),), file=str(path))
        path.write_text("#" * (MAX_FILE_BYTES + 1))
        with pytest.raises(LaunchFileError, match=f"is larger than {MAX_FILE_BYTES} bytes"):
            FILES.description(str(path))
    for name in ("a.launch.json", "launch"):
        with pytest.raises(
            LaunchFileError, match=r"a launch file's name ends with one of \.py, \.yaml, \.yml, \.toml"
        ):
            FILES.description(str(tmp_path / name))


def test_a_file_that_is_not_there_is_no_launch_file(tmp_path: Path) -> None:
    """Nor is one that describes nothing."""
    (tmp_path / "empty.py").touch()
    with pytest.raises(LaunchFileError, match="No launch file"):
        FILES.description(str(tmp_path / "none.py"))
    with pytest.raises(LaunchFileError, match="No launch file"):
        FILES.description("a\0b.yaml")
    with pytest.raises(LaunchFileError, match="has no function generate_launch_description"):
        FILES.description(str(tmp_path / "empty.py"))


def test_a_package_is_looked_up_once(site: Site, monkeypatch: pytest.MonkeyPatch) -> None:
    """However often a launch has its programs; one that is not there may come."""
    asked: list[str] = []

    def counting(name: str) -> object:
        asked.append(name)
        return find_package(name)

    monkeypatch.setattr(module, "find_package", counting)
    files = Files()
    for _ in range(2):
        with pytest.raises(LaunchError):
            files.program("robot", "talker")
    site.install("robot", scripts=["talker = robot:main"])
    commands = {tuple(files.program("robot", "talker")) for _ in range(3)}
    assert len(commands) == 1
    assert files.sources(package="robot") == files.sources(package="robot")
    assert asked == ["robot"] * 3
