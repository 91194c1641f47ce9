"""Lines on the screen: labelled, coloured if wanted, and only those that are for it."""

from __future__ import annotations

import pytest

from actors.launch.description.process_actions import OutputMode
from actors.launch.output.screen import Screen
from actors.launch.planning.events import Event, Level, Message, Stream
from tests.actors.launch.event_samples import spec, started, wrote


def shown(*events: Event, color: bool = False) -> str:
    """Return what these events look like."""
    written: list[bytes] = []
    screen = Screen(written.append, color=color)
    for event in events:
        screen(event)
    return b"".join(written).decode(errors="surrogateescape")


def test_lines_have_labels() -> None:
    """Those of processes as they are, those of the launch with a level."""
    talker = spec()
    events = started(talker), wrote(talker, b"one", b"\xfftwo\x1b[1m"), Message(Level.WARN, "hm")
    assert shown(*events) == (
        "[INFO] [talker-1]: process started with pid [7]\n"
        "[talker-1] one\n[talker-1] \udcfftwo\x1b[1m\x1b[0m\n"
        "[WARN] [launch]: hm\n"
    )


@pytest.mark.parametrize("color", [False, True])
def test_what_a_process_writes_is_sanitized_too(color: bool) -> None:
    """It neither clears the screen nor writes over its label; colours pass, and others' lines as they are."""
    lines = shown(wrote(spec("n"), b"\x1b[2Jcleared", b"10 %\r20 %", b"plain", b"\x1b[31mred"), color=color)
    assert lines == "[n] cleared\n[n] 20 %\n[n] plain\n[n] \x1b[31mred\x1b[0m\n"


def test_what_the_launch_says_is_sanitized() -> None:
    """Control characters in a description's texts are escaped."""
    assert shown(Message(Level.INFO, "a\x1b[2J\rb")) == "[INFO] [launch]: a\\x1b[2J\\rb\n"


@pytest.mark.parametrize("color", [False, True])
def test_each_line_of_what_the_launch_says_is_labelled(color: bool) -> None:
    """So that none looks as if it were a program's."""
    begin, end = ("\x1b[33m", "\x1b[0m") if color else ("", "")
    lines = shown(Message(Level.WARN, "a\nb"), color=color).splitlines()
    assert lines == [f"{begin}[WARN] [launch]: {each}{end}" for each in "ab"]


def test_each_label_has_a_color_of_its_own() -> None:
    """The same in all of its lines; a line that leaves a colour on is ended by a reset."""
    one, two = (spec(f"n-{number}") for number in (1, 2))
    lines = shown(started(one), wrote(one, b"x"), wrote(two, b"\x1b[31mred"), color=True).splitlines()
    assert lines == [
        "[INFO] \x1b[36m[n-1]\x1b[0m: process started with pid [7]",
        "\x1b[36m[n-1]\x1b[0m x",
        "\x1b[35m[n-2]\x1b[0m \x1b[31mred\x1b[0m",
    ]
    assert len({shown(wrote(spec(f"n-{number}"), b""), color=True)[:5] for number in range(1, 8)}) == 7
    assert shown(wrote(spec("n-1000"), b""), color=True).startswith("\x1b[")


def test_levels_are_colored() -> None:
    """As in a node's log; what is no process has no colour."""
    events = (Message(level, "x") for level in Level)
    assert shown(*events, color=True) == (
        "\x1b[32m[DEBUG] [launch]: x\x1b[0m\n"
        "[INFO] [launch]: x\n\x1b[33m[WARN] [launch]: x\x1b[0m\n\x1b[31m[ERROR] [launch]: x\x1b[0m\n"
    )


@pytest.mark.parametrize(
    ("mode", "streams"),
    [
        (OutputMode.SCREEN, "stdout stderr output"),
        (OutputMode.BOTH, "stdout stderr output"),
        (OutputMode.FULL, "stdout stderr output"),
        (OutputMode.LOG, "stderr"),
        (OutputMode.OWN_LOG, ""),
    ],
)
def test_the_output_mode_says_what_is_shown(mode: OutputMode, streams: str) -> None:
    """With LOG only what is written to stderr; that it has started in any case."""
    process = spec(output=mode)
    seen = shown(*(wrote(process, stream.value.encode(), stream=stream) for stream in Stream))
    assert seen.split() == [word for each in streams.split() for word in ("[talker-1]", each)]
    assert "started" in shown(started(process))
