"""Share folders of ROS 2's prefixes, for tests."""

from __future__ import annotations

import sys
from contextlib import contextmanager
from typing import TYPE_CHECKING

from actors.interfaces.catalog import SHARE_ROOT, share_folders
from actors.interfaces.share_packages import ShareFinder

if TYPE_CHECKING:
    from collections.abc import Generator


@contextmanager
def no_shares() -> Generator[None]:
    """Search no share folder; at the end, forget those that were added and what was imported from them."""
    before, modules = share_folders[:], set(sys.modules)
    share_folders.clear()
    try:
        yield
    finally:
        share_folders[:] = before
        sys.meta_path[:] = [each for each in sys.meta_path if before or not isinstance(each, ShareFinder)]
        for name in set(sys.modules) - modules:
            if name.startswith(SHARE_ROOT):
                del sys.modules[name]
