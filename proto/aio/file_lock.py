"""A lock on a file that several processes change."""

from __future__ import annotations

import os
import sys
import time
from contextlib import contextmanager
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from collections.abc import Generator

LOCK_TIMEOUT_SEC: Final = 5.0
"""How long to wait for a lock that another process holds."""

LOCK_RETRY_SEC: Final = 0.01


@contextmanager
def hold_lock(file: str) -> Generator[None]:
    """Hold the lock of a file: another file beside it. The system releases it if the process dies.

    Args:
        file: The path of the file that the lock protects. Its folder is made if it does not exist.

    Raises:
        TimeoutError: Another holds the lock for `LOCK_TIMEOUT_SEC`.
        OSError: The lock file, which is the path with `.lock`, cannot be opened.
    """
    os.makedirs(os.path.dirname(file) or ".", mode=0o700, exist_ok=True)  # noqa: PTH103, PTH120
    lock = os.open(f"{file}.lock", os.O_RDWR | os.O_CREAT, 0o600)
    try:
        deadline = time.monotonic() + LOCK_TIMEOUT_SEC
        while not _try_lock(lock):
            if time.monotonic() > deadline:
                raise TimeoutError(f"another process is changing {file}: try again")
            time.sleep(LOCK_RETRY_SEC)
        yield
    finally:
        os.close(lock)


def _try_lock(descriptor: int) -> bool:
    try:
        if sys.platform == "win32":
            import msvcrt  # noqa: PLC0415 - Windows only

            msvcrt.locking(descriptor, msvcrt.LK_NBLCK, 1)
        else:
            import fcntl  # noqa: PLC0415 - not on Windows

            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except (BlockingIOError, PermissionError):
        return False
    return True
