"""Verbs are found, and every way to end has its exit code and one plain text."""

from __future__ import annotations

import asyncio
import errno
import os
import re
import signal
import subprocess
import sys
from importlib.metadata import version
from typing import TYPE_CHECKING, NoReturn

import pytest

from actors.cli import main, table
from actors.cli.commands.interface import list as interface_list
from actors.cli.errors import CommandError
from actors.cli.interrupts import Interrupted
from actors.errors import BrokerUnreachable, NotAuthorized, ServiceTimeout, TlsFailed
from proto.errors import TlsFileError
from proto.wire.tls import TlsFault

if TYPE_CHECKING:
    from broker import Broker

if TYPE_CHECKING:
    from pathlib import Path


def test_help_names_every_verb(capsys: pytest.CaptureFixture[str]) -> None:
    """Asked for, the usage goes to stdout with 0."""
    assert main.main(["--help"]) == 0
    out = capsys.readouterr().out
    assert all(f"  {verb} " in out for verb in table.VERBS)


def test_help_of_a_group_names_its_verbs(capsys: pytest.CaptureFixture[str]) -> None:
    """So does the group alone, as an error."""
    group = table.VERBS["topic"]
    assert isinstance(group, table.Group)
    assert main.main(["topic", "--help"]) == 0
    out = capsys.readouterr().out
    assert all(f"  {verb} " in out for verb in group.verbs)
    assert main.main(["topic"]) == 2
    assert capsys.readouterr() == ("", out)


def test_without_a_verb_the_usage_is_an_error(capsys: pytest.CaptureFixture[str]) -> None:
    """Then it goes to stderr, with 2."""
    assert main.main([]) == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    assert "usage: callboard" in captured.err


def test_version_is_the_packages(capsys: pytest.CaptureFixture[str]) -> None:
    """--version prints name and version."""
    assert main.main(["--version"]) == 0
    assert capsys.readouterr().out == f"callboard {version('callboard')}\n"


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        (["topc"], "callboard: no verb 'topc'; did you mean 'topic'?\n"),
        (["\x1b[31mqqq"], "callboard: no verb '\\x1b[31mqqq'; see callboard --help\n"),
        (["--verbose"], "callboard: no option '--verbose'; see callboard --help\n"),
        (["topic", "lst"], "callboard topic: no verb 'lst'; did you mean 'list'?\n"),
        (["node", "zzz"], "callboard node: no verb 'zzz'; see callboard node --help\n"),
        (["node", "-x"], "callboard node: no option '-x'; see callboard node --help\n"),
        (
            ["topic", "list", "--jsn"],
            "callboard topic list: unrecognized arguments: --jsn; see callboard topic list --help\n",
        ),
    ],
)
def test_wrong_usage_is_one_line(capsys: pytest.CaptureFixture[str], arguments: list[str], text: str) -> None:
    """It says what is wrong and what helps, with 2 and nothing on stdout."""
    assert main.main(arguments) == 2
    captured = capsys.readouterr()
    assert (captured.out, captured.err) == ("", text)


@pytest.mark.parametrize(
    ("error", "code"),
    [
        (CommandError("text"), 1),
        (CommandError("text", 42), 42),
        (BrokerUnreachable("text"), 3),
        (NotAuthorized("text"), 3),
        (TlsFailed(TlsFault.EXPIRED, "text"), 3),
        (TlsFileError("text"), 3),
        (ServiceTimeout("text"), 124),
    ],
)
def test_errors_have_exit_codes(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], error: Exception, code: int
) -> None:
    """Their text, and no more, stands on stderr."""
    _interface_raises(monkeypatch, error)
    assert main.main(["interface", "list"]) == code
    assert capsys.readouterr().err == "text\n"


@pytest.mark.parametrize(
    ("error", "text"),
    [
        (OSError("text"), "text"),
        (OSError(), "OSError"),
        (OSError(errno.ENOSPC, "No space left on device"), "No space left on device"),
        (PermissionError(errno.EACCES, "Permission denied", "/x"), "Permission denied: /x"),
        (FileExistsError(errno.EEXIST, "File exists", b"/x", None, b"/y"), "File exists: /x: /y"),
    ],
    ids=str,
)
def test_what_the_system_refuses_is_one_plain_line(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], error: OSError, text: str
) -> None:
    """What was tried, why it does not work, and with which file; no number."""
    _interface_raises(monkeypatch, error)
    assert main.main(["interface", "list"]) == 1
    assert capsys.readouterr().err == f"callboard interface list: {text}\n"


@pytest.mark.parametrize(
    ("error", "code"),
    [
        (Interrupted(signal.SIGINT), 130),
        (Interrupted(signal.SIGTERM), 143),
        (KeyboardInterrupt(), 130),
        (BrokenPipeError(), 141),
    ],
)
def test_signals_and_broken_pipes_are_silent(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], error: BaseException, code: int
) -> None:
    """Nothing is printed; the code is a shell's."""
    _interface_raises(monkeypatch, error)
    assert main.main(["interface", "list"]) == code
    captured = capsys.readouterr()
    assert (captured.out, captured.err) == ("", "")


def test_a_verb_that_stays_may_be_stopped(monkeypatch: pytest.MonkeyPatch) -> None:
    """SIGTERM to what runs until it is stopped is no failure."""
    _interface_raises(monkeypatch, Interrupted(signal.SIGTERM))
    group = table.Group("types", {"list": table.Verb("stay", stays=True)})
    monkeypatch.setitem(table.VERBS, "interface", group)
    assert main.main(["interface", "list"]) == 0


def test_signal_handlers_are_put_back() -> None:
    """A program that calls main keeps its own."""
    before = signal.getsignal(signal.SIGTERM)
    main.main(["--version"])
    assert signal.getsignal(signal.SIGTERM) is before


@pytest.mark.processes
def test_help_loads_neither_asyncio_nor_the_nodes() -> None:
    """So that it starts fast."""
    code = (
        "import sys; from actors.cli.main import main; main(['topic', 'pub', '--help']);"
        "sys.exit(bool({'asyncio', 'msgspec', 'yaml', 'actors.node.node', 'broker'} & set(sys.modules)))"
    )
    subprocess.run([sys.executable, "-c", code], check=True, stdout=subprocess.DEVNULL, timeout=50)


@pytest.mark.parametrize(
    "arguments",
    [
        ["topic", "list", "-v"],
        ["topic", "info", "/x"],
        ["topic", "type", "/x"],
        ["topic", "find", "std_msgs/msg/String"],
        ["service", "list"],
        ["service", "info", "/x"],
        ["node", "list"],
        ["node", "info", "/x"],
        ["interface", "list"],
        ["interface", "packages"],
        ["interface", "package", "std_msgs"],
        ["topic", "hz", "/x", "--timeout", "0.1"],
        ["topic", "bw", "/x", "--timeout", "0.1"],
        ["graph"],
        ["graph", "--format", "svg"],
        ["top", "--once", "--interval", "0.1"],
    ],
    ids=" ".join,
)
@pytest.mark.processes
async def test_what_only_asks_loads_no_node(arguments: list[str], broker: Broker) -> None:
    """A question to the broker needs neither asyncio nor message classes, whatever the answer."""
    code = (
        "import sys; from actors.cli.main import main; main(sys.argv[1:]);"
        "print(*{'asyncio', 'msgspec', 'yaml', 'actors.node', 'broker'} & set(sys.modules), file=sys.stderr)"
    )
    process = await asyncio.create_subprocess_exec(
        *(sys.executable, "-c", code, *arguments),
        env={**os.environ, "CALLBOARD_URL": broker.url},
        stdout=asyncio.subprocess.DEVNULL,
        stderr=asyncio.subprocess.PIPE,
    )
    _, err = await asyncio.wait_for(process.communicate(), 50)
    assert not re.search(r"asyncio|msgspec|yaml|actors|broker", err.decode())


@pytest.mark.processes
def test_python_m_actors_is_callboard() -> None:
    """The same command, without an installed script."""
    ended = subprocess.run(
        [sys.executable, "-m", "actors", "--version"], check=True, capture_output=True, text=True, timeout=50
    )
    assert ended.stdout.startswith("callboard ")


def _interface_raises(monkeypatch: pytest.MonkeyPatch, error: BaseException) -> None:
    def run(options: object) -> NoReturn:
        raise error

    monkeypatch.setattr(interface_list, "run", run)


@pytest.mark.processes
def test_another_package_called_proto_is_one_clear_text(tmp_path: Path) -> None:
    """Where it goes before callboard's, the text says where it is; no traceback."""
    file = tmp_path / "proto.py"
    file.touch()
    code = "from actors.cli.main import main; raise SystemExit(main(['doctor']))"
    ended = subprocess.run(
        [sys.executable, "-c", f"import sys; sys.path.insert(0, {str(tmp_path)!r}); {code}"],
        check=False,
        capture_output=True,
        text=True,
        timeout=50,
    )
    assert ended.returncode == 1
    assert ended.stderr.startswith(
        f"callboard: the import name 'proto' belongs to another package here: {file}\n"
    )
    assert "Traceback" not in ended.stderr


@pytest.mark.parametrize("words", [["topic"], ["topic", "echo"], ["doctor"]])
def test_help_may_stand_first(words: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    """`callboard help topic` is `callboard topic --help`."""
    assert main.main(["help", *words]) == 0
    first = capsys.readouterr().out
    assert main.main([*words, "--help"]) == 0
    assert first == capsys.readouterr().out
    assert first.startswith(f"usage: callboard {' '.join(words)}")


@pytest.mark.parametrize("word", table.ELSEWHERE)
def test_a_word_of_ros_that_is_no_verb(word: str, capsys: pytest.CaptureFixture[str]) -> None:
    """One line says what there is instead, whatever follows the word."""
    for rest in ([], ["list", "--help"]):
        assert main.main([word, *rest]) == 2
        assert capsys.readouterr() == ("", f"callboard has no '{word}': {table.ELSEWHERE[word]}\n")


def test_other_words_of_ros_are_no_verbs_of_callboard() -> None:
    """A word that becomes a verb has to leave the list."""
    assert not set(table.ELSEWHERE) & set(table.VERBS)
    assert set(table.ALIASES.values()) <= set(table.VERBS)


@pytest.mark.parametrize(
    ("arguments", "wanted"),
    [
        (["wtf", "--help"], "usage: callboard doctor "),
        (["wtf", "hello", "--help"], "usage: callboard doctor hello "),
        (["doctor", "hello", "--help"], "usage: callboard doctor hello "),
        (["--use-python-default-buffering", "topic", "list", "--help"], "usage: callboard topic list "),
        (["topic", "--include-hidden-topics", "list", "--help"], "usage: callboard topic list "),
        (["service", "--include-hidden-services", "info", "--help"], "usage: callboard service info "),
        (["topic", "--include-hidden-topics"], "usage: callboard topic VERB"),
    ],
)
def test_lines_of_ros_are_understood(
    arguments: list[str], wanted: str, capsys: pytest.CaptureFixture[str]
) -> None:
    """What ROS 2 writes in front of a verb, and its other name of `doctor`."""
    main.main(arguments)
    assert "".join(capsys.readouterr()).startswith(wanted)
