"""callboard's roles, one module per family: what a process of a trial does.

A role is a coroutine function `(parameters, parent) -> figures`. `ROLES` maps names to modules.
"""

from __future__ import annotations

from typing import Final

ROLES: Final = {
    "publisher": "stream",
    "subscriber": "stream",
    "server": "requests",
    "requester": "requests",
    "idle": "idle",
    "pacer": "mixed",
    "listener": "mixed",
    "topics_publisher": "growth",
    "topics_subscriber": "growth",
    "holder": "growth",
    "hoarder": "growth",
    "action_server": "actions",
    "goal_sender": "actions",
    "log_writer": "logs",
    "log_reader": "logs",
    "stream_together": "together",
    "calls_together": "together",
}

ABILITIES: Final = frozenset({"growth", "pace", "types"})
"""What these roles understand beside what all contenders' roles do: many of everything, messages at a pace,
message types."""

HELD: Final = frozenset({"server", "action_server", "idle", "holder", "hoarder"})
"""The roles that go on until the parent closes their stdin; the others give up then."""
