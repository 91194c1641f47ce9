"""The hidden nodes of tools: they watch the graph, and call what is in it, without being shown in it."""

from __future__ import annotations

import os
import secrets
from typing import Final

from actors.node.node import Node

GOODBYE_SEC: Final = 0.5


def hidden_name(program: str) -> str:
    """Return a node name that nobody else uses.

    Args:
        program: What the name begins with, after the `_` for which tools hide a name. `logging` never forgets
            the logger of a name, so a process that makes many nodes makes one name.
    """
    # A process id alone is not unique: in a container it is 1.
    return f"_{program}_{os.getpid()}_{secrets.token_hex(3)}"


def make_hidden_node(
    name: str,
    *,
    url: str,
    domain: int,
    token: str | None = None,
    client_address: str | None = None,
    shared_name: bool = False,
    use_sim_time: bool = False,
    connect_timeout_sec: float | None = None,
    stop_timeout_sec: float = GOODBYE_SEC,
) -> Node:
    """Return a node without the endpoints that other nodes have: nobody asks it, and it declares less.

    It takes no arguments of its program, whose remapping is for the program's own nodes, and warns of no slow
    callback: a terminal, or a reader of a page, may be slow.

    Args:
        name: Its name, as `hidden_name` makes it.
        url: The URLs of the broker.
        domain: The number of the graph.
        token: As for `Node`.
        client_address: As for `Node`.
        shared_name: As for `Node`.
        use_sim_time: Its clock follows `/clock`.
        connect_timeout_sec: As for `Node`.
        stop_timeout_sec: As for `Node`; default: for a node that has nothing to send but its goodbye.
    """
    return Node(
        name,
        url=url,
        domain=domain,
        token=token,
        client_address=client_address,
        shared_name=shared_name,
        use_global_arguments=False,
        parameter_overrides={"start_type_description_service": False, "use_sim_time": use_sim_time},
        start_parameter_services=False,
        enable_rosout=False,
        start_diagnostics_service=False,
        connect_timeout_sec=connect_timeout_sec,
        stop_timeout_sec=stop_timeout_sec,
        slow_callback_sec=None,
    )
