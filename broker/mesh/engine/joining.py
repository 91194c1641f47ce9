"""Lets a broker join a mesh; imports Zenoh only then."""

from __future__ import annotations

import re
import secrets
import socket
from typing import TYPE_CHECKING

from broker.errors import ConfigurationError
from broker.mesh.engine.member import MeshMember
from proto.extras import install_command

if TYPE_CHECKING:
    from collections.abc import Callable

    from broker.mesh.engine.engine import Engine, Host
    from broker.options import BrokerOptions
    from broker.serving.dispatcher import Dispatcher
    from proto.aio.read_budget import ReadBudget


async def join_mesh(
    dispatcher: Dispatcher,
    options: BrokerOptions,
    budget: ReadBudget,
    make_engine: Callable[[int, Host], Engine] | None,
) -> MeshMember:
    """Join a mesh.

    Args:
        dispatcher: The broker's links.
        options: The broker's options.
        budget: The read budget of the broker's event loop.
        make_engine: Returns an engine for a broker's number and host; None for Zenoh.

    Raises:
        ConfigurationError: Zenoh is not installed, a file cannot be used, or an endpoint is malformed.
        ListenError: It cannot listen for other brokers.
        UnprotectedError: Somebody who may not use the broker could join without credentials.
    """
    make = make_engine or _zenoh_engine(options, budget)
    # Random, because nobody assigns the numbers of brokers.
    number = 1 + secrets.randbelow(2**31 - 1)
    name = re.sub(r"[^A-Za-z0-9._-]", "-", socket.gethostname()).lstrip("._-")[:63]
    member = MeshMember(number, dispatcher, make, options.mesh_name or name or "broker")
    # Before it starts: the engine may report brokers at once, whose graphs need the dispatcher's routers.
    dispatcher.mesh = member
    await member.start()
    return member


def _zenoh_engine(options: BrokerOptions, budget: ReadBudget) -> Callable[[int, Host], Engine]:
    try:
        from broker.mesh.engine.zenoh_config import make_config  # noqa: PLC0415 - an extra
        from broker.mesh.engine.zenoh_engine import ZenohEngine  # noqa: PLC0415 - an extra
    except ImportError as error:
        if error.name != "zenoh":
            raise
        text = f"A mesh of brokers needs Zenoh: {install_command('zenoh')}"
        raise ConfigurationError(text) from None
    config = make_config(options)
    return lambda number, host: ZenohEngine(number, host, budget, config)
