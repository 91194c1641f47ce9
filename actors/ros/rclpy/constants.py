"""Units."""

from __future__ import annotations

from typing import Final

S_TO_NS: Final = 1_000_000_000
