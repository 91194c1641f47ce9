"""Environment variables: what they mean, and what a wrong one says."""

from __future__ import annotations

import contextvars
import os
from pathlib import Path

import pytest

from actors.config.environment import (
    InvalidEnvironmentError,
    broker_url,
    cache_folder,
    color_wish,
    config_folder,
    domain_id,
    environment_for,
    foreign_variables,
    ignored_ros_domain,
    is_journal,
    log_level,
    stand_in,
    state_folder,
    variables_for_tests,
)
from proto.errors import CallboardError


def test_unset_and_empty_are_none() -> None:
    """A variable that is unset or empty has no say."""
    for environ in (
        {},
        {"CALLBOARD_URL": "", "CALLBOARD_DOMAIN": "", "CALLBOARD_LOG_LEVEL": "", "NO_COLOR": ""},
    ):
        assert broker_url(environ) is None
        assert domain_id(environ) is None
        assert log_level(environ) is None
        assert color_wish(environ) is None


def test_process_environment_is_the_default(monkeypatch: pytest.MonkeyPatch) -> None:
    """Without an argument the process's own environment is read, at the time of the call."""
    monkeypatch.setenv("CALLBOARD_URL", "callboard://10.0.0.1:7411")
    monkeypatch.setenv("CALLBOARD_DOMAIN", "7")
    monkeypatch.setenv("CALLBOARD_LOG_LEVEL", "debug")
    assert (broker_url(), domain_id(), log_level()) == ("callboard://10.0.0.1:7411", 7, "debug")


@pytest.mark.parametrize(("text", "domain"), [("0", 0), ("232", 232), ("042", 42)])
def test_domain(text: str, domain: int) -> None:
    """A domain is 0 to 232."""
    assert domain_id({"CALLBOARD_DOMAIN": text}) == domain


def test_domain_of_a_program_written_for_ros() -> None:
    """ROS_DOMAIN_ID counts for it, and callboard's own variable goes first."""
    assert domain_id({"ROS_DOMAIN_ID": "5"}) is None
    assert domain_id({"ROS_DOMAIN_ID": "5"}, ros=True) == 5
    assert domain_id({"ROS_DOMAIN_ID": ""}, ros=True) is None
    assert domain_id({"ROS_DOMAIN_ID": "5", "CALLBOARD_DOMAIN": "7"}, ros=True) == 7
    with pytest.raises(InvalidEnvironmentError, match="ROS_DOMAIN_ID must be an integer from 0 to 232"):
        domain_id({"ROS_DOMAIN_ID": "robot"}, ros=True)


@pytest.mark.parametrize(
    ("environ", "warned"),
    [
        ({"ROS_DOMAIN_ID": "5"}, True),
        ({"ROS_DOMAIN_ID": "0"}, False),
        ({"ROS_DOMAIN_ID": ""}, False),
        ({"ROS_DOMAIN_ID": "robot"}, False),
        ({"ROS_DOMAIN_ID": "5", "CALLBOARD_DOMAIN": "0"}, False),
        ({}, False),
    ],
)
def test_a_domain_of_ros_that_is_not_used(environ: dict[str, str], warned: bool) -> None:
    """Where it would change something, the warning says what; a chosen domain is meant."""
    text = ignored_ros_domain(0, environ)
    assert (text is not None) is warned
    assert text is None or "export CALLBOARD_DOMAIN=5 " in text


@pytest.mark.parametrize("text", ["-1", "233", "1.0", "1_0", " 1", "٣", "one", "9" * 5000, "\x1b[2J"])
def test_bad_domain(text: str) -> None:
    """Anything else is an error that says the variable and the range, harmless to print."""
    with pytest.raises(
        InvalidEnvironmentError, match="CALLBOARD_DOMAIN must be an integer from 0 to 232"
    ) as caught:
        domain_id({"CALLBOARD_DOMAIN": text})
    assert str(caught.value).isprintable()
    assert isinstance(caught.value, ValueError)
    assert isinstance(caught.value, CallboardError)


@pytest.mark.parametrize(
    ("environ", "wish"),
    [
        ({"NO_COLOR": "1"}, False),
        ({"NO_COLOR": "1", "FORCE_COLOR": "1"}, False),
        ({"FORCE_COLOR": "1"}, True),
        ({"TERM": "dumb"}, False),
        ({"TERM": "xterm"}, None),
    ],
)
def test_color_wish(environ: dict[str, str], wish: bool | None) -> None:
    """NO_COLOR goes before FORCE_COLOR; a dumb terminal has no colours; otherwise the terminal decides."""
    assert color_wish(environ) is wish


def test_a_log_level_that_is_none_is_refused() -> None:
    """The error names the variable, the value and the levels; case does not matter."""
    assert log_level({"CALLBOARD_LOG_LEVEL": "Warn"}) == "Warn"
    with pytest.raises(InvalidEnvironmentError, match=r"CALLBOARD_LOG_LEVEL must be one of DEBUG.*'loud'"):
        log_level({"CALLBOARD_LOG_LEVEL": "loud"})


def test_a_context_can_have_a_stand_in(monkeypatch: pytest.MonkeyPatch) -> None:
    """It is read instead of the process's environment, and children get it; others see nothing of it."""
    monkeypatch.setenv("CALLBOARD_URL", "callboard://10.0.0.1:7411")

    def look() -> None:
        stand_in.set({"CALLBOARD_DOMAIN": "7"})
        assert (broker_url(), domain_id()) == (None, 7)
        assert environment_for({}) == {"CALLBOARD_DOMAIN": "7"}
        assert broker_url({"CALLBOARD_URL": "given"}) == "given"

    contextvars.copy_context().run(look)
    assert (broker_url(), domain_id()) == ("callboard://10.0.0.1:7411", None)
    assert environment_for({}) is None


def test_folders_are_where_the_standard_says() -> None:
    """In the user's home, or where absolute paths say; others do not count."""
    for folder, variable, usual in (
        (config_folder, "XDG_CONFIG_HOME", "~/.config"),
        (state_folder, "XDG_STATE_HOME", "~/.local/state"),
        (cache_folder, "XDG_CACHE_HOME", "~/.cache"),
    ):
        assert folder({variable: "/x"}) == "/x/callboard"
        assert folder({}) == folder({variable: "x"}) == str(Path(usual).expanduser() / "callboard")


def test_foreign_variables_are_all_but_our_own(monkeypatch: pytest.MonkeyPatch) -> None:
    """What chooses a broker or a log level stays out; of the process, unless others are given."""
    given = {"CALLBOARD_URL": "a", "CALLBOARD_CONTEXT": "b", "NO_COLOR": "1", "PATH": "/bin"}
    assert foreign_variables(given) == {"NO_COLOR": "1", "PATH": "/bin"}
    assert variables_for_tests({**given, "ROS_DOMAIN_ID": "5"}) == foreign_variables(given)
    monkeypatch.setenv("CALLBOARD_DOMAIN", "7")
    monkeypatch.setenv("MINE", "8")
    assert foreign_variables()["MINE"] == "8"
    assert "CALLBOARD_DOMAIN" not in foreign_variables()


def test_the_journal_is_known_by_its_stream(tmp_path: Path) -> None:
    """systemd names the device and the inode of what it has connected; a redirection is something else."""
    with (tmp_path / "one").open("w") as one, (tmp_path / "other").open("w") as other:
        found = os.fstat(one.fileno())
        environ = {"JOURNAL_STREAM": f"{found.st_dev}:{found.st_ino}"}
        assert is_journal(one.fileno(), environ)
        assert not is_journal(other.fileno(), environ)
        assert not is_journal(one.fileno(), {})
