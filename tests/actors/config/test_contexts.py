"""Named brokers: what is kept, what is refused, and which one is meant."""

from __future__ import annotations

import os
import stat
import subprocess
import sys
from contextlib import suppress
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from actors import Node
from actors.config import contexts as module
from actors.config.context_errors import ContextError, UnknownContextError
from actors.config.contexts import (
    DEFAULT,
    Context,
    Contexts,
    contexts_file,
    find_broker_target,
    warn_of_ros_domain,
)
from actors.config.environment import InvalidEnvironmentError
from proto.aio import file_lock
from proto.errors import InvalidUrlError
from proto.wire.url import DEFAULT_URL
from tests.fork_server.client import FORKED
from tests.seams.cli import read_back
from tests.seams.nodes import link_of

ROBOT = Context(url="callboard://robot:7411", domain=3, description='the "big" one \\ \N{ROBOT FACE}')
LAB = Context(url="callboard://a:1,callboard+unix:///b")


@pytest.fixture(autouse=True)
def home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A configuration directory of the test's own, and no variable that says where to go."""
    for name in ("CALLBOARD_URL", "CALLBOARD_DOMAIN", "CALLBOARD_CONTEXT", "ROS_DOMAIN_ID"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path))
    return tmp_path


@pytest.fixture
def kept(home: Path) -> Contexts:
    """Two contexts in the file; none in use but the default."""
    contexts = Contexts()
    contexts.add("robot", ROBOT)
    contexts.add("lab", LAB)
    contexts.save()
    return contexts


def write(text: str) -> None:
    """Put a text where the contexts stand."""
    file = Path(contexts_file())
    file.parent.mkdir(exist_ok=True)
    file.write_text(text, encoding="utf-8")


def test_what_is_saved_is_loaded(kept: Contexts) -> None:
    """Nothing is lost in the file, and only its owner can read it."""
    kept.use("robot")
    kept.save()
    assert Contexts.load() == kept
    assert stat.S_IMODE(Path(contexts_file()).stat().st_mode) == 0o600
    assert [each.name for each in Path(contexts_file()).parent.iterdir()] == ["contexts.toml"]


@given(st.text(st.characters(codec="utf-8"), max_size=30).filter(str.isprintable))
def test_any_description_survives(text: str) -> None:
    """Whatever can be printed can be written as TOML and read back."""
    contexts = Contexts()
    contexts.add("robot", Context(url="callboard://robot", description=text))
    assert read_back(contexts) == (contexts.named, DEFAULT)


ADD = """
import sys
from actors.config.contexts import Context, Contexts
sys.stdin.readline()
with Contexts.changing() as contexts:
    contexts.add(sys.argv[1], Context(url="callboard://robot"))
"""


@pytest.mark.processes
def test_processes_that_change_it_together_lose_nothing() -> None:
    """Each sees what the others have written."""
    names = [f"robot{number}" for number in range(8)]
    adders = [
        subprocess.Popen(
            [sys.executable, "-c", ADD, name], executable=FORKED, stdin=subprocess.PIPE, text=True
        )
        for name in names
    ]
    for adder in adders:
        assert adder.stdin is not None
        adder.stdin.write("go\n")
        adder.stdin.flush()
    for adder in adders:
        with adder:
            assert adder.wait(timeout=50) == 0
    assert Contexts.load().names() == (DEFAULT, *names)


def test_nobody_waits_for_the_file_for_ever(monkeypatch: pytest.MonkeyPatch) -> None:
    """Who cannot have it says so, and has changed nothing; an error keeps nothing either."""
    monkeypatch.setattr(file_lock, "LOCK_TIMEOUT_SEC", 0.0)
    with Contexts.changing() as contexts:
        with pytest.raises(ContextError, match="another process"), Contexts.changing():
            pass
        contexts.add("robot", ROBOT)
    with suppress(KeyError), Contexts.changing() as contexts:
        contexts.add("lab", LAB)
        raise KeyError
    assert Contexts.load().names() == (DEFAULT, "robot")


def test_without_a_file_there_is_the_default() -> None:
    """It is callboard's own place, is always there, and cannot be changed."""
    contexts = Contexts.load()
    assert (contexts.names(), contexts.current, contexts.get(DEFAULT).url) == (
        (DEFAULT,),
        DEFAULT,
        DEFAULT_URL,
    )
    with pytest.raises(ContextError, match="always there"):
        contexts.remove(DEFAULT)
    with pytest.raises(ContextError, match="callboard's own"):
        contexts.add(DEFAULT, ROBOT)


def test_removing_what_is_in_use_brings_the_default_back(kept: Contexts) -> None:
    """The file never names a context that is not there."""
    kept.use("robot")
    kept.remove("robot")
    assert (kept.current, kept.names()) == (DEFAULT, (DEFAULT, "lab"))


def test_an_unknown_name_says_which_are_known(kept: Contexts) -> None:
    """So that whoever asks can suggest one."""
    for ask in (kept.get, kept.use, kept.remove):
        with pytest.raises(UnknownContextError, match="No context 'robt'") as caught:
            ask("robt")
        assert caught.value.known == (DEFAULT, "lab", "robot")


def test_a_name_is_taken_once(kept: Contexts) -> None:
    """Another URL needs `replace`."""
    with pytest.raises(ContextError, match="already"):
        kept.add("robot", LAB)
    kept.add("robot", LAB, replace=True)
    assert kept.get("robot") == LAB


@pytest.mark.parametrize("name", ["", "-x", "a b", "a.b", "ä", "x" * 65, "a\n", "\x1b[2J"])
def test_names_are_plain_words(name: str) -> None:
    """Anything else is refused with what a name may be, harmless to print."""
    with pytest.raises(ContextError, match="letters, digits") as caught:
        Contexts().add(name, ROBOT)
    assert str(caught.value).isprintable()


def test_what_a_context_says_is_checked() -> None:
    """A wrong URL, domain or description is refused before it is kept."""
    contexts = Contexts()
    with pytest.raises(InvalidUrlError):
        contexts.add("x", Context(url="http://robot"))
    with pytest.raises(ContextError, match="0 to 232"):
        contexts.add("x", Context(url="callboard://robot", domain=233))
    with pytest.raises(ContextError, match="one line"):
        contexts.add("x", Context(url="callboard://robot", description="a\nb"))
    assert not contexts.named


def test_there_is_a_limit(monkeypatch: pytest.MonkeyPatch) -> None:
    """Contexts do not grow without end, but the last one can still be replaced."""
    monkeypatch.setattr(module, "MAX_CONTEXTS", 1)
    contexts = Contexts()
    contexts.add("robot", ROBOT)
    with pytest.raises(ContextError, match="remove one"):
        contexts.add("lab", LAB)
    contexts.add("robot", LAB, replace=True)


@pytest.mark.parametrize(
    ("text", "wrong"),
    [
        ('current = "a"\n[contexts = 3', "line 2"),
        ("curent = 'a'", "no key 'curent'"),
        ("current = 3", "current must be of type str"),
        ("contexts = 3", "contexts must be of type dict"),
        ("[contexts.robot]\ndomain = 3", "contexts.robot needs a url"),
        ("[contexts.robot]\nurl = 'callboard://a'\ndomain = true", "robot.domain must be of type int"),
        ("[contexts.robot]\nurl = 'callboard://a'\ndomain = 500", "contexts.robot: domain must be"),
        ("[contexts.robot]\nurl = 'http://a'", "contexts.robot: Invalid broker URL"),
        ("[contexts.'a b']\nurl = 'callboard://a'", "cannot be called 'a b'"),
    ],
)
def test_a_broken_file_says_where(text: str, wrong: str) -> None:
    """The text names the file, and the line or the key."""
    write(text)
    with pytest.raises(ContextError, match=wrong) as caught:
        Contexts.load()
    assert str(caught.value).startswith(contexts_file())


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="needs named pipes")
def test_a_named_pipe_in_its_place_is_refused() -> None:
    """Case 86: reading it would never end."""
    Path(contexts_file()).parent.mkdir()
    os.mkfifo(contexts_file())
    with pytest.raises(ContextError, match=r"contexts\.toml: not a regular file"):
        Contexts.load()


def test_a_file_that_is_none_says_so(home: Path) -> None:
    """No text, too much of it, or a folder: one error, with the file's name."""
    Path(contexts_file()).parent.mkdir()
    Path(contexts_file()).write_bytes(b"\xff")
    with pytest.raises(ContextError, match="utf-8"):
        Contexts.load()
    write("#" * (module.MAX_FILE_BYTES + 1))
    with pytest.raises(ContextError, match="longer than"):
        Contexts.load()
    Path(contexts_file()).unlink()
    Path(contexts_file()).mkdir()
    with pytest.raises(ContextError, match="Cannot read"):
        Contexts.load()
    with pytest.raises(ContextError, match="Cannot write"):
        Contexts().save()


def test_the_nearest_word_counts(kept: Contexts, monkeypatch: pytest.MonkeyPatch) -> None:
    """Options, then the named context, then the environment, then the context in use, then the default."""

    def place(*said: object) -> tuple[str, int, str, str]:
        found = find_broker_target(*said)  # type: ignore[arg-type]
        return found.url, found.domain, found.url_from, found.domain_from

    assert place() == (DEFAULT_URL, 0, "default", "default")
    kept.use("robot")
    kept.save()
    assert place() == (ROBOT.url, 3, "context 'robot'", "context 'robot'")
    monkeypatch.setenv("CALLBOARD_CONTEXT", "lab")
    assert place() == (LAB.url, 0, "context 'lab'", "default")
    monkeypatch.setenv("CALLBOARD_DOMAIN", "5")
    assert place() == (LAB.url, 5, "context 'lab'", "CALLBOARD_DOMAIN")
    monkeypatch.setenv("CALLBOARD_URL", "callboard://there:1")
    assert place() == ("callboard://there:1", 5, "CALLBOARD_URL", "CALLBOARD_DOMAIN")
    assert place(None, None, "robot") == (ROBOT.url, 3, "context 'robot'", "context 'robot'")
    assert place(None, None, "lab") == (LAB.url, 5, "context 'lab'", "CALLBOARD_DOMAIN")
    assert place("callboard://here:2", 7, "robot") == ("callboard://here:2", 7, "--url", "--domain")
    assert place("callboard://here:2") == ("callboard://here:2", 5, "--url", "CALLBOARD_DOMAIN")


def test_a_contexts_domain_belongs_to_its_url(kept: Contexts, monkeypatch: pytest.MonkeyPatch) -> None:
    """With another broker than the context's its domain does not count, and the file is not even read."""
    kept.use("robot")
    kept.save()
    monkeypatch.setenv("CALLBOARD_URL", "callboard://there:1")
    assert find_broker_target().domain == 0
    write("broken")
    assert find_broker_target().domain == find_broker_target("callboard://here:2").domain == 0


def test_what_names_a_missing_context_is_named(kept: Contexts, monkeypatch: pytest.MonkeyPatch) -> None:
    """A wrong CALLBOARD_CONTEXT, and a file whose choice is gone, can be told apart."""
    monkeypatch.setenv("CALLBOARD_CONTEXT", "robt")
    with pytest.raises(UnknownContextError, match=r"No context 'robt' \(CALLBOARD_CONTEXT\)"):
        find_broker_target()
    monkeypatch.setenv("CALLBOARD_CONTEXT", DEFAULT)
    assert find_broker_target().url == DEFAULT_URL
    monkeypatch.delenv("CALLBOARD_CONTEXT")
    write("current = 'gone'")
    with pytest.raises(UnknownContextError, match=r"No context 'gone' \(in use in .*contexts.toml\)"):
        find_broker_target()


def test_a_wrong_domain_in_the_environment_is_an_error(monkeypatch: pytest.MonkeyPatch) -> None:
    """It is not taken for 0."""
    monkeypatch.setenv("CALLBOARD_DOMAIN", "many")
    with pytest.raises(InvalidEnvironmentError):
        find_broker_target()


def test_a_node_goes_where_the_context_says(kept: Contexts, monkeypatch: pytest.MonkeyPatch) -> None:
    """A script that names no broker follows the context in use."""
    kept.use("robot")
    kept.save()
    assert link_of(Node("talker")).broker_urls == ROBOT.url


def test_a_domain_of_ros_is_warned_of_once(monkeypatch: pytest.MonkeyPatch, kept: Contexts) -> None:
    """Unless something has chosen the domain."""
    monkeypatch.setenv("ROS_DOMAIN_ID", "211")
    warnings: list[str] = []
    warn_of_ros_domain(find_broker_target(domain=0), warnings.append)
    warn_of_ros_domain(find_broker_target(context="robot"), warnings.append)
    assert not warnings
    for _ in range(2):
        warn_of_ros_domain(find_broker_target(), warnings.append)
    (warning,) = warnings
    assert warning.startswith("ROS_DOMAIN_ID=211 counts for programs that run with --ros only")


def test_a_node_warns_of_a_domain_of_ros(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    """In its log, with the remedy."""
    monkeypatch.setenv("ROS_DOMAIN_ID", "212")
    for name in ("one", "two"):
        Node(name).destroy_node()
    (record,) = [each for each in caplog.records if "ROS_DOMAIN_ID" in each.getMessage()]
    assert "export CALLBOARD_DOMAIN=212 " in record.getMessage()
