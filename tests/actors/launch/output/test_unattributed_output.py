"""What is printed beside the launch's lines."""

from __future__ import annotations

import threading

from actors.launch.output.unattributed_output import UnattributedOutput
from actors.launch.planning.events import Stream


def test_only_whole_lines_are_passed_on() -> None:
    """Each stream for itself; the rest of a line at the end."""
    got: list[tuple[str, bytes]] = []
    output = UnattributedOutput(
        {
            Stream.STDOUT: lambda data: got.append(("out", data)),
            Stream.STDERR: lambda data: got.append(("err", data)),
        }
    )
    output.write(Stream.STDOUT, b"a ")
    output.write(Stream.STDERR, b"bad\n")
    output.write(Stream.STDOUT, b"line\nand another\nno end")
    assert got == [("err", b"bad\n"), ("out", b"a line\nand another\n")]
    output.end()
    assert got[2:] == [("out", b"no end\n")]


def test_threads_do_not_disturb_each_other() -> None:
    """No byte is lost, and nothing comes twice."""
    got = bytearray()
    output = UnattributedOutput({Stream.STDOUT: got.extend})

    def chatter() -> None:
        for _ in range(1000):
            output.write(Stream.STDOUT, b"ab\ncd")

    threads = [threading.Thread(target=chatter) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    output.end()
    assert len(got) == 4 * 1000 * 5 + 1
