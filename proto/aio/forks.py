"""Keep a parent's connections, listening sockets and pipes out of its forked children.

A peer notices the end of a process only when no process holds the connection's descriptor any more, so a
child with a copy hides the death of its parent. Closing the copies would be wrong: their owners (transports,
servers) exist in the child as well and close the same numbers later, when these may belong to other files.
Therefore each descriptor stays open in the child but refers to the null device.
"""

from __future__ import annotations

import os
import weakref
from typing import TYPE_CHECKING, Final, Protocol

if TYPE_CHECKING:
    from collections.abc import Iterable


class DescriptorOwner(Protocol):
    """An object whose descriptors forked children must not keep."""

    def descriptors(self) -> Iterable[int]:
        """Return the open descriptors."""
        ...


_owners: Final[weakref.WeakSet[DescriptorOwner]] = weakref.WeakSet()


def drop_in_children(owner: DescriptorOwner) -> None:
    """Redirect the descriptors that `owner` has at a fork to the null device in the child.

    Args:
        owner: Asked at each fork for as long as it lives; only a weak reference is kept.
    """
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
