"""Events of nodes."""

from __future__ import annotations

from actors.launch import matches_node_name as matches_node_name
from actors.ros.launch_ros.events import lifecycle as lifecycle
