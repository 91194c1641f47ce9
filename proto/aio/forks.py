"""What a forked child must not keep: connections, listening sockets and pipes of its parent.

A peer notices the end of a process only when nobody has its end of the connection any more, so a child that
keeps a copy hides the death of its parent. Closing the copies would be wrong, too: their owners (transports,
servers) exist in the child as well and close the same numbers later, when these may belong to other files.
So each number stays open, and its owner's, but refers to the null device.
"""

from __future__ import annotations

import os
import weakref
from typing import TYPE_CHECKING, Final, Protocol

if TYPE_CHECKING:
    from collections.abc import Iterable


class DescriptorOwner(Protocol):
    """Something with descriptors that are not for forked children."""

    def descriptors(self) -> Iterable[int]:
        """Return the numbers of its open descriptors."""
        ...


_owners: Final[weakref.WeakSet[DescriptorOwner]] = weakref.WeakSet()


def drop_in_children(owner: DescriptorOwner) -> None:
    """Let no process forked from now on keep the descriptors that `owner` has when it forks."""
    _owners.add(owner)


def _after_fork_in_child() -> None:
    descriptors = [number for owner in tuple(_owners) for number in owner.descriptors()]
    if not descriptors:
        return
    null = os.open(os.devnull, os.O_RDWR)
    for number in descriptors:
        os.dup2(null, number, inheritable=False)
    os.close(null)


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_after_fork_in_child)
