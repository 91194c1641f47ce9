"""Log lines: ROS 2's format, harmless text, colours, and who owns the handlers."""

from __future__ import annotations

import contextlib
import io
import logging
import re
from typing import TYPE_CHECKING

import pytest

from actors.logging.logger import Logger, get_logger
from actors.logging.output import RosFormatter, configure_logging
from actors.logging.severity import LoggingSeverity

if TYPE_CHECKING:
    from collections.abc import Generator


@contextlib.contextmanager
def bare_root() -> Generator[logging.Logger]:
    """The root logger without handlers (pytest adds its own after fixtures); everything is put back."""
    root = logging.getLogger()
    top = logging.getLogger("callboard")
    handlers, level = root.handlers[:], top.level
    root.handlers[:] = []
    try:
        yield root
    finally:
        root.handlers[:] = handlers
        top.setLevel(level)


class Terminal(io.StringIO):
    """A stream that says that it is a terminal."""

    def isatty(self) -> bool:
        return True


def record(message: str, *, name: str = "callboard.ns.node", level: int = logging.INFO) -> logging.LogRecord:
    made = logging.LogRecord(name, level, __file__, 1, message, (), None)
    made.stamp_ns = 1605120000_123456789
    return made


@pytest.mark.parametrize(
    ("level", "label"),
    [(10, "DEBUG"), (20, "INFO"), (30, "WARN"), (40, "ERROR"), (50, "FATAL"), (25, "Level 25")],
)
def test_format(level: int, label: str) -> None:
    """Severity, seconds.nanoseconds, logger name without our prefix, message."""
    line = RosFormatter().format(record("text", level=level))
    assert line == f"[{label}] [1605120000.123456789] [ns.node]: text"


def test_stamp_keeps_leading_zeros() -> None:
    """Nanoseconds have nine digits."""
    made = record("x")
    made.stamp_ns = 5_000_000_042
    assert "[5.000000042]" in RosFormatter().format(made)


def test_foreign_records() -> None:
    """A record of another library has no nanosecond stamp: its own time is used, and its name is whole."""
    made = logging.LogRecord("asyncio", logging.WARNING, __file__, 1, "slow %d", (3,), None)
    made.created = 12.5
    assert RosFormatter().format(made) == "[WARN] [12.500000000] [asyncio]: slow 3"


def test_control_characters_are_escaped() -> None:
    """What could steer a terminal is escaped in messages and names; line ends and tabs of a message stay."""
    line = RosFormatter().format(record("a\x1b[2J\r\tb\nc\u202e\ud800é", name="callboard.n\n\x07"))
    assert line.endswith("[n\\n\\x07]: a\\x1b[2J\\r\tb\nc\\u202e\\ud800é")


def test_traceback_follows() -> None:
    """An exception's traceback follows the message, made as harmless as the message."""
    made = record("failed")
    error = ValueError("\x1b[31m")
    with contextlib.suppress(ValueError):
        raise error
    made.exc_info = (type(error), error, error.__traceback__)
    lines = RosFormatter().format(made).splitlines()
    assert lines[0].endswith("[ns.node]: failed")
    assert lines[1].startswith("Traceback")
    assert lines[-1] == r"ValueError: \x1b[31m"


@pytest.mark.parametrize(
    ("level", "color"), [(10, "\x1b[32m"), (20, ""), (30, "\x1b[33m"), (40, "\x1b[31m"), (50, "\x1b[31m")]
)
def test_colors(level: int, color: str) -> None:
    """Each severity has its colour, INFO none."""
    line = RosFormatter(color=True).format(record("x", level=level))
    assert line.startswith(color + "[")
    assert line.endswith("\x1b[0m" if color else "x")


def test_configured_stream() -> None:
    """A script's records go to the stream; a second call replaces the first."""
    with bare_root() as root:
        first, second = io.StringIO(), io.StringIO()
        configure_logging(stream=first)
        configure_logging("debug", stream=second)
        assert get_logger("test_configured_stream").debug("hello")
        assert first.getvalue() == ""
        assert re.fullmatch(
            r"\[DEBUG\] \[\d+\.\d{9}\] \[test_configured_stream\]: hello\n", second.getvalue()
        )
        assert len(root.handlers) == 1


@pytest.mark.parametrize("level", [LoggingSeverity.UNSET, "UNSET", 0])
def test_unset_means_info(level: LoggingSeverity | int | str) -> None:
    """Without a level of its own the process logs INFO."""
    with bare_root():
        configure_logging(level, stream=io.StringIO())
        assert get_logger("test_unset_means_info").get_effective_level() is LoggingSeverity.INFO


def test_stderr_is_the_default(capsys: pytest.CaptureFixture[str]) -> None:
    """Lines go to stderr, and other libraries' warnings too."""
    with bare_root():
        configure_logging()
        get_logger("test_stderr").info("ours")
        logging.getLogger("test_other_library").warning("theirs")
        out, err = capsys.readouterr()
        assert out == ""
        assert "[test_stderr]: ours\n" in err
        assert "[test_other_library]: theirs\n" in err


def test_a_programs_own_handlers_stand() -> None:
    """If the program has configured logging, only the level is set."""
    with bare_root() as root:
        own = logging.StreamHandler(io.StringIO())
        root.addHandler(own)
        configure_logging(LoggingSeverity.ERROR)
        assert root.handlers == [own]
        assert get_logger("test_own").get_effective_level() is LoggingSeverity.ERROR


def test_without_any_handler_lines_go_to_stderr(capsys: pytest.CaptureFixture[str]) -> None:
    """A script sees what it logs before `actors.run`; nothing is configured, a NullHandler silences it."""
    with bare_root() as root:
        logger = get_logger("test_unconfigured")
        assert logger.info("hello")
        assert root.handlers == logging.getLogger("callboard").handlers == []
        top, null = logging.getLogger("callboard"), logging.NullHandler()
        top.addHandler(null)
        try:
            logger.info("unseen")
        finally:
            top.removeHandler(null)
    assert re.fullmatch(r"\[INFO\] \[\d+\.\d{9}\] \[test_unconfigured\]: hello\n", capsys.readouterr().err)


def test_bad_level() -> None:
    """An unknown level is a ValueError and changes nothing."""
    with bare_root() as root:
        with pytest.raises(ValueError, match="not a log level"):
            configure_logging("loud")
        assert root.handlers == []


@pytest.mark.parametrize(
    ("environ", "terminal", "colored"),
    [
        ({}, True, True),
        ({}, False, False),
        ({"NO_COLOR": "1"}, True, False),
        ({"FORCE_COLOR": "1"}, False, True),
    ],
)
def test_when_colors_are_used(
    monkeypatch: pytest.MonkeyPatch,
    environ: dict[str, str],
    terminal: bool,
    colored: bool,
) -> None:
    """Colours need a terminal, unless NO_COLOR or FORCE_COLOR says otherwise."""
    with bare_root():
        for variable in ("NO_COLOR", "FORCE_COLOR", "TERM"):
            monkeypatch.delenv(variable, raising=False)
        for variable, value in environ.items():
            monkeypatch.setenv(variable, value)
        stream = Terminal() if terminal else io.StringIO()
        configure_logging(stream=stream)
        get_logger("test_colors").error("x")
        assert ("\x1b[31m" in stream.getvalue()) is colored


def test_only_fatal_records_are_printed(capsys: pytest.CaptureFixture[str]) -> None:
    """What `--disable-stdout-logs` asks for; levels stay, other libraries are printed, and it can end."""
    with bare_root():
        configure_logging(only_fatal=True)
        logger = get_logger("test_only_fatal")
        assert logger.info("hidden")
        assert Logger().info("hidden")
        logger.fatal("shown")
        logging.getLogger("test_other_library").warning("theirs")
        configure_logging()
        logger.info("again")
    lines = capsys.readouterr().err.splitlines()
    assert [line.rpartition(": ")[2] for line in lines] == ["shown", "theirs", "again"]
