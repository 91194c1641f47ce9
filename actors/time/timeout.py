"""The time limit of waits that name none."""

from __future__ import annotations

from enum import Enum
from typing import Final, TypeAlias


class DefaultTimeout(Enum):
    """The type of `DEFAULT_TIMEOUT`, for annotations. None cannot be the default: it means no limit."""

    DEFAULT_TIMEOUT = "default_call_timeout_sec"

    def __repr__(self) -> str:
        return self.name


DEFAULT_TIMEOUT: Final = DefaultTimeout.DEFAULT_TIMEOUT
"""As `timeout_sec`: the node's `default_call_timeout_sec`. The default where a function passes a limit on."""

Timeout: TypeAlias = float | DefaultTimeout | None
"""Seconds, None for no limit, or the node's default."""
