"""Events of lifecycle nodes."""

from __future__ import annotations

from actors.launch import (
    ChangeState as ChangeState,
    matches_node_name as matches_node_name,
)
from actors.launch.planning.events import StateTransition as StateTransition
