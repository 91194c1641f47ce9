"""The hidden nodes of a launch."""

from __future__ import annotations

import os
import secrets
from typing import TYPE_CHECKING, Final

from actors.node.node import Node

if TYPE_CHECKING:
    from actors.config.contexts import BrokerTarget

STOP_TIMEOUT_SEC: Final = 0.5
"""The nodes have nothing to send but their goodbyes."""


def launch_node_name() -> str:
    """Return a name for a launch; the names of its nodes begin with it."""
    # A process id alone is not unique: in a container it is 1.
    return f"_launch_{os.getpid()}_{secrets.token_hex(3)}"


def launch_node(target: BrokerTarget, name: str) -> Node:
    """Return a hidden node.

    Args:
        target: The broker, and the number of its graph.
        name: Its name.
    """
    return Node(
        name,
        url=target.url,
        domain=target.domain,
        use_global_arguments=False,
        parameter_overrides={"start_type_description_service": False},
        start_parameter_services=False,
        enable_rosout=False,
        start_diagnostics_service=False,
        stop_timeout_sec=STOP_TIMEOUT_SEC,
        slow_callback_sec=None,
    )
