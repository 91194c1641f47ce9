"""What can be wrong on this side is found, and each finding says what to do."""

from __future__ import annotations

import os
import shutil
import sys
from pathlib import Path

import msgpack
import pytest

from actors.config.contexts import Context, Contexts, contexts_file
from actors.tools import machine_checks
from actors.tools.check import Check


@pytest.fixture(autouse=True)
def home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A configuration directory of the test's own, and none of callboard's variables."""
    for name in [name for name in os.environ if name.startswith("CALLBOARD_")]:
        monkeypatch.delenv(name)
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "config"))


def bad(checks: list[Check]) -> list[tuple[str, str]]:
    """Return status and finding of what is not ok; each of them has a remedy."""
    assert all(check.remedy for check in checks if check.status in {"warn", "fail"})
    return [(check.status, check.finding) for check in checks if check.status != "ok"]


def test_here_everything_is_in_order() -> None:
    """No check finds anything wrong where the tests run."""
    assert all(check.status != "fail" for check in machine_checks.all_checks())


def test_an_old_python_is_wrong() -> None:
    """Before 3.11 callboard does not run."""
    assert machine_checks.python((3, 11, 0)).status == "ok"
    ((status, finding),) = bad([machine_checks.python((3, 10, 9))])
    assert status == "fail"
    assert "3.10.9" in finding


def test_a_missing_uvloop_is_reported_where_there_is_one(monkeypatch: pytest.MonkeyPatch) -> None:
    """On Windows there is none to be missed."""
    monkeypatch.setitem(sys.modules, "uvloop", None)
    assert bad([machine_checks.event_loop(platform_name="linux")])[0][0] == "warn"
    assert machine_checks.event_loop(platform_name="win32").status == "ok"


def test_a_slow_or_broken_codec_is_reported(monkeypatch: pytest.MonkeyPatch) -> None:
    """Without the C extension things work, slowly; without msgspec they do not."""
    fallback = type("Packer", (), {"__module__": "msgpack.fallback"})
    monkeypatch.setattr(msgpack, "Packer", fallback)
    ((status, finding),) = bad([machine_checks.codec()])
    assert status == "warn"
    assert "without its C extension" in finding
    monkeypatch.setitem(sys.modules, "msgspec", None)
    assert bad([machine_checks.codec()])[0][0] == "fail"


def test_another_owner_of_an_import_name_is_named() -> None:
    """PyPI's proto-plus, above all; callboard itself is no other."""
    claims = {"proto": ["callboard", "proto-plus"], "actors": ["callboard"]}
    assert bad(machine_checks.import_names(claims)) == [
        ("fail", "'proto' also belongs to proto-plus: each overwrites files of the other")
    ]
    assert not bad(machine_checks.import_names({}))


def test_the_lists_of_files_of_distributions_tell_their_owners(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """By their lists of files, or of top-level names; names that only begin alike are others."""
    for name, file, text in (
        ("proto-plus", "RECORD", "proto_plus-1.dist-info/RECORD,,\nproto/enums.py,sha256=x,1\n"),
        ("one-file", "RECORD", "broker.py,sha256=x,1\n"),
        ("declared", "top_level.txt", "other\nactors\n"),
        ("alike", "RECORD", "callboards/a.py,,\nbroker_b.py,,\nbroker.pyx,,\na/proto/b.py,,\n"),
    ):
        folder = tmp_path / f"{name}-1.dist-info"
        folder.mkdir()
        (folder / "METADATA").write_text(f"Name: {name}\nVersion: 1\n")
        (folder / file).write_text(text)
    monkeypatch.syspath_prepend(tmp_path)
    assert [finding for _, finding in bad(machine_checks.import_names())] == [
        "'proto' also belongs to proto-plus: each overwrites files of the other",
        "'broker' also belongs to one-file: each overwrites files of the other",
        "'actors' also belongs to declared: each overwrites files of the other",
    ]


def test_a_package_from_elsewhere_is_found(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """What was imported under callboard's name is not where callboard is."""
    other = type(sys)("broker")
    other.__path__ = [str(tmp_path / "broker")]
    monkeypatch.setitem(sys.modules, "broker", other)
    ((status, finding),) = bad(machine_checks.import_names({}))
    assert (status, finding) == ("fail", f"'broker' is {tmp_path / 'broker'}, not callboard's")


def test_what_hides_callboard_from_scripts_is_found(tmp_path: Path) -> None:
    """A file or a package beside them; a bare folder hides nothing, nor does callboard itself."""
    (tmp_path / "actors").mkdir()
    assert not machine_checks.shadows(tmp_path)
    (tmp_path / "broker.py").touch()
    (tmp_path / "actors" / "__init__.py").touch()
    found = bad(machine_checks.shadows(tmp_path))
    assert [status for status, _ in found] == ["warn", "warn"]
    assert "broker.py hides callboard's 'broker'" in found[0][1]
    assert "hides callboard's 'actors'" in found[1][1]


def test_a_clone_of_callboard_does_not_hide_callboard(tmp_path: Path) -> None:
    """Neither the one that is imported, nor another one."""
    clone = Path(machine_checks.__file__).parent.parent.parent
    assert not machine_checks.shadows(clone)
    for name in ("proto/__init__.py", "broker/__init__.py", "actors/__init__.py", "actors/cli/main.py"):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(clone / name, tmp_path / name)
    assert not machine_checks.shadows(tmp_path)


def test_few_open_files_are_reported() -> None:
    """The hard limit is what counts for a broker."""
    assert machine_checks.judged_files(256, 524_288).status == "ok"
    assert machine_checks.judged_files(1024, -1) == Check(
        "open files", "ok", "1024 for a process, no limit for a broker"
    )
    assert bad([machine_checks.judged_files(256, 1024)])[0][0] == "warn"


@pytest.mark.parametrize(
    ("environ", "status", "finding"),
    [
        ({"CALLBOARD_URI": "x"}, "warn", "CALLBOARD_URI is set, and means nothing to callboard"),
        ({"CALLBOARD_URL": "http://x"}, "fail", "CALLBOARD_URL: Invalid broker URL"),
        ({"CALLBOARD_DOMAIN": "x"}, "fail", "CALLBOARD_DOMAIN must be an integer from 0 to 232"),
        ({"CALLBOARD_LOG_LEVEL": "loud"}, "fail", "CALLBOARD_LOG_LEVEL must be one of"),
    ],
)
def test_wrong_variables_are_found(environ: dict[str, str], status: str, finding: str) -> None:
    """A misspelt one may hurt; a wrong value will."""
    ((found_status, found),) = bad(machine_checks.variables(environ))
    assert found_status == status
    assert found.startswith(finding)
    assert machine_checks.variables({"CALLBOARD_URL": "callboard://a"})[0].finding == "CALLBOARD_URL"
    assert "CALLBOARD_URL?" in machine_checks.variables({"CALLBOARD_URI": "x"})[0].remedy


def test_the_file_of_contexts_is_checked(monkeypatch: pytest.MonkeyPatch) -> None:
    """None is fine; a broken one, a choice that is gone, and one that others can read are reported."""
    assert machine_checks.contexts()[0].finding == "no named contexts"
    contexts = Contexts()
    contexts.add("robot", Context(url="callboard://robot"))
    contexts.use("robot")
    contexts.save()
    assert machine_checks.contexts()[0].finding == "1 named; 'robot' is in use"
    monkeypatch.setenv("CALLBOARD_CONTEXT", "robt")
    assert bad(machine_checks.contexts()) == [("fail", "No context 'robt' (CALLBOARD_CONTEXT)")]
    monkeypatch.delenv("CALLBOARD_CONTEXT")
    file = Path(contexts_file())
    file.chmod(0o644)
    assert bad(machine_checks.contexts()) == [("warn", f"others can read or write {file}")]
    file.write_text("broken", encoding="utf-8")
    assert bad(machine_checks.contexts())[0][0] == "fail"
