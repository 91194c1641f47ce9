"""The context that functions of a description are called with."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING

from actors.launch import LaunchContext as CallboardContext
from actors.ros.launch.library import ros_files

if TYPE_CHECKING:
    from collections.abc import Iterable


class LaunchContext(CallboardContext):
    """The context of no launch, for programs that evaluate substitutions themselves.

    Args:
        argv: Ignored.
        noninteractive: Ignored.
    """

    def __init__(self, *, argv: Iterable[str] | None = None, noninteractive: bool = False) -> None:
        super().__init__(library=ros_files(), environment=dict(os.environ))
