"""`callboard node list`."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:
    from tests.actors.cli.conftest import Desk


@pytest.mark.parametrize(
    ("options", "out"),
    [
        ([], "/ns/zoe\n"),
        (["-a"], "/_hidden\n/ns/zoe\n"),
        (["-c"], "1\n"),
        (["-a", "-c"], "2\n"),
        (["--json"], '[{"name": "/ns/zoe"}]\n'),
    ],
)
async def test_list(desk: Desk, options: list[str], out: str) -> None:
    """Full names, sorted, without hidden ones and without the command's own node."""
    async with desk.node("zoe", namespace="ns") as node, desk.node("_hidden") as other:
        await node.get_graph()
        await other.get_graph()
        assert await desk.callboard("node", "list", *options) == (0, out, "")
