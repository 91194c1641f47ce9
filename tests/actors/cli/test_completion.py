"""Completion: the possible next words, with a broker and without, in the form that each shell reads."""

from __future__ import annotations

import asyncio
import shutil
import subprocess
import sys
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from actors.cli.completion import FILES, Offer, offers, script, split_line
from actors.cli.main import main
from actors.cli.table import VERBS
from actors.config.contexts import Context, Contexts
from actors.interfaces.example_interfaces.action import Fibonacci
from actors.interfaces.std_msgs.msg import String
from actors.interfaces.std_srvs.srv import Trigger
from tests.interfaces.shares import no_shares
from tests.seams.limits import set_limits

if TYPE_CHECKING:
    from tests.actors.cli.conftest import Desk

ROOT = Path(__file__).resolve().parents[3]


@pytest.fixture(autouse=True)
def home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """No broker but one that a test names, with time for its answer, and no contexts but its own."""
    set_limits(monkeypatch, completion_broker_sec=20.0)
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path))
    monkeypatch.setenv("CALLBOARD_URL", "callboard+unix:///nowhere")
    for name in ("CALLBOARD_DOMAIN", "CALLBOARD_CONTEXT"):
        monkeypatch.delenv(name, raising=False)


def words(line: str) -> list[str]:
    """Return the words that are offered for a line behind `callboard`."""
    return [offer.word for offer in offers(split_line(f"callboard {line}"))]


@pytest.mark.parametrize(
    ("line", "split"),
    [
        ("callboard", []),
        ("callboard ", [""]),
        ("callboard topic ec", ["topic", "ec"]),
        ("callboard topic echo ", ["topic", "echo", ""]),
        ("callboard topic pub /x T '{data: a", ["topic", "pub", "/x", "T", "{data: a"]),
        ('callboard topic pub "/x ', ["topic", "pub", "/x "]),
    ],
)
def test_a_line_is_split_as_a_shell_does(line: str, split: list[str]) -> None:
    """An open quote belongs to the word that is being typed; a space begins another."""
    assert split_line(line) == split


def test_verbs_come_first() -> None:
    """All of them, with what they do; then those of a group."""
    assert [offer.word for offer in offers([""])] == [*VERBS, "--help", "--version"]
    assert offers(["topic", "ech"]) == [Offer("echo", "print the messages of a topic")]
    assert words("qqq ") == words("topic qqq ") == []


def test_options_are_offered_when_a_dash_is_typed() -> None:
    """With what they mean; no hidden ones, and none that is there already."""
    assert offers(["topic", "list", "--include"]) == [
        Offer("--include-hidden-topics", "also names with a leading _")
    ]
    assert "--json" not in words("topic list --json --")
    assert "--words" not in words("completion bash --")


def test_values_of_options_are_offered() -> None:
    """Behind the option or behind its =; where anything may stand nothing is."""
    assert words("topic echo --qos-history ") == ["system_default", "keep_last", "keep_all", "unknown"]
    assert words("topic echo --qos-history=keep_l") == ["--qos-history=keep_last"]
    assert words("topic echo --timeout ") == []
    assert words("completion ") == ["bash", "zsh", "fish"]


def test_types_are_offered_without_a_broker() -> None:
    """Messages for topics, services for calls, all where any may stand."""
    assert words("topic pub /x std_msgs/msg/Str") == ["std_msgs/msg/String"]
    assert words("service call /x std_srvs/srv/Tr") == ["std_srvs/srv/Trigger"]
    assert words("topic pub /x std_srvs/srv/Tr") == []
    assert words("interface show std_srvs/srv/Tr") == ["std_srvs/srv/Trigger"]
    assert words("interface package std_") == ["std_msgs", "std_srvs"]


def test_types_of_an_installed_ros_2_are_offered(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Those of packages in AMENT_PREFIX_PATH."""
    (tmp_path / "share" / "completed_msgs" / "msg").mkdir(parents=True)
    (tmp_path / "share" / "completed_msgs" / "msg" / "Wheel.msg").write_text("int32 a\n")
    monkeypatch.setenv("AMENT_PREFIX_PATH", str(tmp_path))
    for line, word in (("package compl", "completed_msgs"), ("show completed", "completed_msgs/msg/Wheel")):
        with no_shares():
            assert words(f"interface {line}") == [word]


def test_files_are_left_to_the_shell() -> None:
    """Where a script or a folder may stand, and for a program's own arguments, whatever these are."""
    assert FILES in offers(["run", ""])
    assert offers(["interface", "generate", ""]) == [FILES]
    assert offers(["run", __file__, "--ur"]) == [FILES]


def test_contexts_are_offered() -> None:
    """By name, with where they are."""
    contexts = Contexts()
    contexts.add("robot", Context(url="callboard://robot"))
    contexts.save()
    robot = Offer("robot", "callboard://robot")
    assert offers(["context", "use", "ro"]) == offers(["topic", "list", "--context", "ro"]) == [robot]


def test_without_a_broker_there_is_silence(capsys: pytest.CaptureFixture[str]) -> None:
    """No text and no failure, also for a place that cannot be."""
    for place in ([], ["--url", "http://x"], ["--context", "nobody"], ["--domain", "x"]):
        assert main(["completion", "zsh", "--words", "topic", "echo", *place, ""]) == 0
    assert capsys.readouterr() == ("", "")


async def test_names_come_from_the_broker(desk: Desk) -> None:
    """Topics, services and actions, their types, and nodes; hidden ones if they were begun."""
    place = f"--url {desk.url}"
    async with desk.node("talker", namespace="/robot") as node:
        node.create_publisher(String, "/chatter", 1)
        node.create_publisher(String, "/_secret", 1)
        node.create_service(Trigger, "push", lambda request, response: response)
        node.create_action_client(Fibonacci, "walk")
        await node.get_graph()

        def ask() -> None:
            assert offers(["topic", "echo", "--url", desk.url, ""]) == [
                Offer("/chatter", "std_msgs/msg/String")
            ]
            assert words(f"topic echo {place} cha") == ["chatter"]
            assert words(f"topic echo {place} /_") == ["/_secret"]
            assert words(f"topic pub {place} chatter ") == ["std_msgs/msg/String"]
            assert words(f"service call {place} /robot/") == ["/robot/push"]
            assert words(f"service call {place} /robot/push ") == ["std_srvs/srv/Trigger"]
            assert words(f"action send_goal {place} /robot/") == ["/robot/walk"]
            assert words(f"action send_goal {place} /robot/walk ") == ["example_interfaces/action/Fibonacci"]
            assert words(f"node info {place} ") == ["/robot/talker"]
            assert words(f"topic echo {place} --domain 9 ") == []

        await asyncio.to_thread(ask)


def test_a_script_is_printed_for_each_shell(capsys: pytest.CaptureFixture[str]) -> None:
    """As it stands."""
    for shell in ("bash", "zsh", "fish"):
        assert main(["completion", shell]) == 0
        assert capsys.readouterr().out == script(shell)


@pytest.mark.processes
def test_completing_loads_little() -> None:
    """Neither a loop nor a node, since somebody waits."""
    code = (
        "import sys; from actors.cli.main import main;"
        "main(['completion', 'bash', '--line', 'callboard topic echo ']);"
        "sys.exit(bool({'asyncio', 'msgspec', 'yaml', 'actors.node.node', 'broker'} & set(sys.modules)))"
    )
    subprocess.run([sys.executable, "-c", code], check=True, timeout=50)


_BASH = """
try() { COMP_LINE="$1"; COMP_POINT=${#1}; COMP_WORDS=(callboard); _callboard; echo "${COMPREPLY[*]}"; }
try "callboard topic ec"
try "callboard topic echo --qos-history=keep_l"
try "callboard context use ro"
try "callboard run "
COMP_WORDBREAKS=" "; try "callboard topic echo --qos-history=keep_l"
"""
_ZSH = """
_describe() { local -a all=("${(@P)4}"); print -rl -- $all }
_files() { print files }
words=(callboard topic ec); CURRENT=3; PREFIX=ec; _callboard
words=(callboard topic echo "--qos-history" keep_l); CURRENT=5; PREFIX=keep_l; _callboard
words=(callboard context use ro); CURRENT=4; PREFIX=ro; _callboard
words=(callboard interface generate ''); CURRENT=4; PREFIX=; _callboard
"""
_FISH = """
function __fish_complete_path; echo files; end
complete -C "callboard topic ec"
complete -C "callboard topic echo --qos-history keep_l"
complete -C "callboard context use ro"
complete -C "callboard interface generate "
"""


@pytest.mark.parametrize(
    ("shell", "before", "trial", "answer"),
    [
        ("bash", "", _BASH, ["echo", "keep_last", "robot", "", "--qos-history=keep_last"]),
        (
            "zsh",
            "compdef() { }",
            _ZSH,
            ["echo:print the messages of a topic", "keep_last", "robot:callboard://robot", "files"],
        ),
        (
            "fish",
            "",
            _FISH,
            ["echo\tprint the messages of a topic", "keep_last", "robot\tcallboard://robot", "files"],
        ),
    ],
)
@pytest.mark.processes
def test_real_shells_understand_their_script(
    shell: str, before: str, trial: str, answer: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Each shell, where it is installed, reads the script and asks callboard by it."""
    program = shutil.which(shell)
    if program is None:
        pytest.skip(f"no {shell} here")
    contexts = Contexts()
    contexts.add("robot", Context(url="callboard://robot"))
    contexts.save()
    command = tmp_path / "bin" / "callboard"
    command.parent.mkdir()
    command.write_text(f'#!/bin/sh\nexec "{sys.executable}" -m actors "$@"\n', encoding="utf-8")
    command.chmod(0o755)
    monkeypatch.setenv("PATH", str(command.parent), prepend=":")
    monkeypatch.setenv("PYTHONPATH", str(ROOT))
    source = f"{before}\n{script(shell)}\n{trial}"
    quiet = {"bash": ["--norc"], "zsh": ["-f"], "fish": ["--no-config"]}[shell]
    ended = subprocess.run(
        [program, *quiet, "-c", source], check=False, capture_output=True, text=True, cwd=tmp_path, timeout=50
    )
    assert ended.stderr == ""
    assert ended.stdout.splitlines() == answer
