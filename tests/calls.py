"""How many calls an action makes: what it costs on any machine."""

from __future__ import annotations

import gc
import sys
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Callable


def calls_of(action: Callable[[], object]) -> int:
    """Run an action; return how many functions it has called, those of C included."""
    calls = 0

    def count(_frame: Any, event: str, function: Any) -> None:
        nonlocal calls
        measured = event == "c_call" and function.__module__ == "slipcover.probe"  # by tests/measurement.py
        calls += event in {"call", "c_call"} and not measured

    gc.disable()  # Hypothesis has a callback for each collection
    sys.setprofile(count)
    try:
        action()
    finally:
        sys.setprofile(None)
        gc.enable()
    return calls
