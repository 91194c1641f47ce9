"""A module of somebody else that hides one of callboard's packages is named, wherever it is imported."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = pytest.mark.processes

ROOT = Path(__file__).resolve().parent.parent
REMEDY = "Rename that, or install callboard into a separate environment: python -m venv\n"


def run(folder: Path, program: str) -> subprocess.CompletedProcess[str]:
    """Run a program where a folder goes before callboard's packages, as that of a script does."""
    first = f"import sys; sys.path[:0] = [{str(folder)!r}, {str(ROOT)!r}]; "
    return subprocess.run(
        [sys.executable, "-c", first + program],
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )


def hide(folder: Path, package: str, *, as_package: bool) -> Path:
    """Write a module of this name, or a package as proto-plus is one; return its file."""
    file = folder / package / "__init__.py" if as_package else folder / f"{package}.py"
    file.parent.mkdir(exist_ok=True)
    file.write_text("__version__ = '1.28'\n")
    return file


@pytest.mark.parametrize(
    ("package", "program"),
    [
        ("proto", "import callboard"),
        ("actors", "import callboard"),
        ("proto", "from actors import Node"),
        ("proto", "from actors.interfaces.std_msgs.msg import String"),
        ("proto", "import actors.launch"),
        ("proto", "from broker import Broker"),
        ("proto", "import runpy; runpy.run_module('broker', run_name='__main__', alter_sys=True)"),
        ("broker", "from callboard import Broker"),
        ("broker", "from actors.testing import launch"),
    ],
)
@pytest.mark.parametrize("as_package", [False, True], ids=["module", "package"])
def test_an_import_names_the_file_that_hides_a_package(
    package: str, program: str, tmp_path: Path, *, as_package: bool
) -> None:
    """In place of "No module named 'proto.errors'; 'proto' is not a package"."""
    file = hide(tmp_path, package, as_package=as_package)
    ended = run(tmp_path, program)
    assert ended.returncode == 1
    text = f"the import name '{package}' belongs to another package here: {file}\n{REMEDY}"
    assert ended.stderr.endswith(f"ImportError: {text}")


@pytest.mark.parametrize("package", ["proto", "broker"])
def test_the_command_prints_it_without_a_traceback(package: str, tmp_path: Path) -> None:
    """Also where it is the broker's package, which other verbs do not need."""
    file = hide(tmp_path, package, as_package=False)
    program = "from actors.cli.main import main; raise SystemExit(main(['broker', '--print-config']))"
    ended = run(tmp_path, program)
    text = f"callboard: the import name '{package}' belongs to another package here: {file}\n{REMEDY}"
    assert (ended.returncode, ended.stderr) == (1, text)


def test_a_file_that_hides_nothing_needed_is_no_error(tmp_path: Path) -> None:
    """Programs whose folder has a broker.py, and that use no broker of callboard."""
    hide(tmp_path, "broker", as_package=False)
    program = "import callboard; from actors.interfaces.std_msgs.msg import String; print(callboard.Node)"
    ended = run(tmp_path, program)
    assert (ended.returncode, ended.stderr) == (0, "")


def test_another_error_of_an_import_stays_as_it_is(tmp_path: Path) -> None:
    """Such as that of a missing library."""
    program = "sys.modules['msgspec'] = None; from actors import Node"
    ended = run(tmp_path, program)
    assert ended.returncode == 1
    assert "import of msgspec halted" in ended.stderr
    assert "another package" not in ended.stderr


def test_looking_for_them_loads_nothing_slow() -> None:
    """Neither pathlib nor typing; and `import callboard` loads none of the packages."""
    program = "import sys; before = {*sys.modules}; import callboard; print(sorted({*sys.modules} - before))"
    ended = subprocess.run(
        [sys.executable, "-S", "-E", "-c", f"import sys; sys.path[:0] = [{str(ROOT)!r}]; {program}"],
        capture_output=True,
        text=True,
        check=True,
    )
    loaded = set(ended.stdout.strip("[]\n").replace("'", "").split(", "))
    assert "callboard" in loaded
    assert loaded.isdisjoint({"actors", "broker", "proto", "pathlib", "typing"})
