"""Runs of upstream's programs, together with others, and the output that they must show.

A pattern is a regular expression of ours for the essential part of a line; all of a program's patterns must
match in their order. Only names and a few words of output are upstream's.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

CALLBOARD: Final = "callboard"
"""In place of a package: the run is a command of callboard, repeated until it succeeds."""
OURS: Final = "ours"
"""In place of a package: the run is a program of this folder, for one that upstream has in C++."""


@dataclass(frozen=True)
class Run:
    """One process of a scenario.

    Attributes:
        package: The package, CALLBOARD or OURS.
        executable: Its console script; for CALLBOARD the command line, for OURS the name of the program.
        args: Its arguments.
        shows: The patterns that must match, in this order.
        after: A pattern that the first run of the scenario must show before this one begins.
        ends: Whether it ends by itself; otherwise SIGINT ends it.
        codes: The exit codes that count as good.
        quiet: Whether a traceback counts as wrong.
        words: How many of its arguments belong to the name of the program: the verb of a command.
    """

    package: str
    executable: str
    args: tuple[str, ...] = ()
    shows: tuple[str, ...] = ()
    after: str = ""
    ends: bool = False
    codes: tuple[int, ...] = (0,)
    quiet: bool = True
    words: int = 0

    @property
    def program(self) -> str:
        """The name of the program in its package."""
        return " ".join((self.executable, *self.args[: self.words]))

    @property
    def name(self) -> str:
        """The name of the program."""
        return f"{self.package} {self.program}"

    @property
    def is_upstream(self) -> bool:
        """Whether it is a program of upstream."""
        return self.package not in {CALLBOARD, OURS}


def example(package: str, executable: str, *shows: str, **options: object) -> Run:
    """Return a run of a program of the collection of examples."""
    return Run(f"examples_rclpy_{package}", executable, shows=shows, **options)  # type: ignore[arg-type]


def demo(package: str, executable: str, *shows: str, **options: object) -> Run:
    """Return a run of a program of the collection of demos."""
    return Run(package, executable, shows=shows, **options)  # type: ignore[arg-type]


def command(line: str, *shows: str, after: str = "") -> Run:
    """Return a run of a command of callboard."""
    return Run(CALLBOARD, line, shows=shows, ends=True, after=after)
