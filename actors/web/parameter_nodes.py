"""The nodes that serve their parameters, as live tools ask them: only those of the graph, a few at a time."""

from __future__ import annotations

import asyncio
from contextlib import asynccontextmanager, suppress
from typing import TYPE_CHECKING, Final

from actors.errors import BrokerUnreachable, ServiceUnavailable
from actors.interfaces.message import type_name
from actors.interfaces.rcl_interfaces.srv import GetParameters
from actors.parameter_client.client import ParameterClient
from proto.untrusted_text import escape
from proto.wire.codes import EntryKind

if TYPE_CHECKING:
    from collections.abc import AsyncGenerator, Iterable

    from actors.graph.snapshot import GraphSnapshot
    from actors.web.workspace import Workspace

MAX_ASKED: Final = 16
"""Nodes that are asked at the same time for one user."""

_TYPE: Final = type_name(GetParameters)


class ParameterNodes:
    """The nodes of one user's graph that serve their parameters; see `Workspace.shared`.

    Args:
        workspace: Of the user.
    """

    def __init__(self, workspace: Workspace) -> None:
        self._observer = workspace.observer
        self._room = asyncio.Semaphore(MAX_ASKED)

    async def missing(self, nodes: Iterable[str]) -> set[str]:
        """Return those of some nodes that do not serve their parameters now.

        A client may name thousands of nodes that do not exist: the graph answers for all of them at once.

        Args:
            nodes: Their full names.
        """
        found = {each for each in nodes if each not in nodes_in(self._observer.around(each))}
        if found:  # one of them may have just started
            with suppress(BrokerUnreachable):
                found -= nodes_in(await self._observer.newest())
        return found

    @asynccontextmanager
    async def client(self, node: str) -> AsyncGenerator[ParameterClient]:
        """Return a client of a node's parameters for the context, once fewer than `MAX_ASKED` are in use.

        Args:
            node: Its full name.

        Raises:
            ServiceUnavailable: It does not serve its parameters.
        """
        if await self.missing([node]):
            raise ServiceUnavailable(f"No node '{escape(node)}' serves its parameters now")
        async with self._room:
            client = ParameterClient(self._observer.node, node)
            try:
                yield client
            finally:
                client.destroy()


def nodes_in(snapshot: GraphSnapshot) -> set[str]:
    """Return the nodes of a graph that serve their parameters.

    Args:
        snapshot: The graph, or the part of it around a node.
    """
    services = snapshot.of_kind(EntryKind.SERVICE)
    return {
        each.node
        for each in services
        if each.type_name == _TYPE and each.name == f"{each.node}/get_parameters"
    }
