"""Add what fuzzing has found to the corpus: `python -m tests.fuzz.keep codec`.

Of `build/fuzz/<target>`, smallest inputs first, it copies those that take a step from one line to another
that no smaller input takes. (libFuzzer's own `-merge=1` cannot start itself again below Python.)
"""

from __future__ import annotations

import hashlib
import sys
from importlib import import_module
from typing import TYPE_CHECKING, Any

from tests.fuzz.__main__ import BUILD, PACKAGES
from tests.fuzz.test_corpus import CORPUS

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path
    from types import FrameType

Step = tuple[str, int, int]


def steps_of(check: Callable[[bytes], None], data: bytes) -> set[Step]:
    """Return the steps from line to line that an input takes in the product."""
    steps: set[Step] = set()

    def enter(frame: FrameType, event: str, _: Any) -> Any:
        name = frame.f_globals.get("__name__", "")
        if name.partition(".")[0] not in PACKAGES:
            return None
        last = 0

        def trace(frame: FrameType, event: str, _: Any) -> Any:
            nonlocal last
            steps.add((name, last, frame.f_lineno))
            last = frame.f_lineno
            return trace

        return trace

    before = sys.gettrace()
    sys.settrace(enter)
    try:
        check(data)
    finally:
        sys.settrace(before)
    return steps


def keep(target: str) -> list[Path]:
    """Copy the inputs that reach something new; return the copies."""
    check = import_module(f"tests.fuzz.{target}").check
    known: set[Step] = set()
    for file in sorted((CORPUS / target).iterdir()):
        known |= steps_of(check, file.read_bytes())
    copies: list[Path] = []
    for file in sorted((BUILD / target).iterdir(), key=lambda file: (file.stat().st_size, file.name)):
        data = file.read_bytes()
        new = steps_of(check, data) - known
        if new:
            known |= new
            copies.append(CORPUS / target / hashlib.sha256(data).hexdigest()[:16])
            copies[-1].write_bytes(data)
    return copies


if __name__ == "__main__":
    sys.stdout.write(f"{len(keep(sys.argv[1]))} inputs added\n")
