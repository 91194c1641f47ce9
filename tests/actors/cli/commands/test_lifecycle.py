"""`callboard lifecycle`: nodes, get, list, set."""

from __future__ import annotations

import asyncio
from textwrap import dedent
from typing import TYPE_CHECKING, Any

import actors
from actors.cli.completion import Offer, offers
from actors.interfaces.lifecycle_msgs.srv import GetState
from actors.interfaces.std_srvs.srv import Trigger
from tests.actors.meeting import BARE, until

if TYPE_CHECKING:
    from actors import LifecycleState, TransitionCallbackReturn
    from tests.actors.cli.conftest import Desk


class Managed(actors.LifecycleNode):
    """A node with states; `activating` is set while it waits in `on_activate`."""

    def __init__(self, desk: Desk, name: str = "managed", **options: Any) -> None:
        super().__init__(name, url=desk.url, **{**BARE, **options})
        self.activating = asyncio.Event()

    async def on_activate(self, state: LifecycleState) -> TransitionCallbackReturn:
        self.activating.set()
        await asyncio.Event().wait()
        raise AssertionError

    def on_cleanup(self, state: LifecycleState) -> TransitionCallbackReturn:
        return actors.TransitionCallbackReturn.FAILURE


async def test_nodes(desk: Desk) -> None:
    """Those that serve their state under ROS 2's name and type; hidden ones with -a."""
    async with Managed(desk, "b") as b, Managed(desk, "_a") as a, desk.node("plain") as plain:
        plain.create_service(Trigger, "~/get_state", lambda request: request)
        for node in (a, b, plain):
            await node.get_graph()
        assert await desk.callboard("lifecycle", "nodes") == (0, "/b\n", "")
        assert (await desk.callboard("lifecycle", "nodes", "-a")).out == "/_a\n/b\n"
        assert (await desk.callboard("lifecycle", "nodes", "--all")).out == "/_a\n/b\n"
        assert (await desk.callboard("lifecycle", "nodes", "-c")).json == 1
        assert (await desk.callboard("lifecycle", "nodes", "--json")).json == [{"name": "/b"}]


async def test_nodes_that_share_a_name_are_marked(desk: Desk) -> None:
    """`nodes` prints the name for each node and warns, as `node list` does."""
    async with Managed(desk, shared_name=True) as one, Managed(desk, shared_name=True) as other:
        await one.get_graph()
        await other.get_graph()
        listed = await desk.callboard("lifecycle", "nodes")
    assert (listed.code, listed.out) == (0, "/managed\n/managed\n")
    assert listed.err.startswith("WARNING: ")
    assert listed.err.endswith(" share an exact name, which can have unintended side effects: /managed (2)\n")


async def test_get(desk: Desk) -> None:
    """The state of one node, or of all with their names; one that fails does not hide the others."""

    def fail(request: GetState.Request) -> GetState.Response:
        raise OSError("broken")

    async with Managed(desk) as node, desk.node("bad") as bad:
        await node.trigger_configure()
        assert await desk.callboard("lifecycle", "get", "managed") == (0, "inactive [2]\n", "")
        assert await desk.callboard("lifecycle", "get") == (0, "/managed: inactive [2]\n", "")
        found = await desk.callboard("lifecycle", "get", "--json")
        assert found.json == [{"node": "/managed", "label": "inactive", "id": 2}]
        bad.create_service(GetState, "~/get_state", fail)
        await bad.get_graph()
        code, out, err = await desk.callboard("lifecycle", "get")
        assert (code, out) == (1, "/managed: inactive [2]\n")
        assert err == (
            "Exception while calling service of node '/bad':"
            " Service '/bad/get_state' failed: OSError: broken\n"
        )
        assert await desk.callboard("lifecycle", "get", "/bad") == (
            1, "", "Node '/bad' failed: OSError: broken\n"
        )  # fmt: skip


async def test_nodes_without_states(desk: Desk) -> None:
    """An unknown node, and one without states, end with a reason."""
    async with desk.node("plain") as node:
        await node.get_graph()
        for verb in (["get"], ["list"], ["set"]):
            rest = ["configure"] if verb == ["set"] else []
            unknown = await desk.callboard("lifecycle", *verb, "/plan", *rest)
            assert unknown == (1, "", "Node not found: '/plan'; did you mean '/plain'?\n")
            plain = await desk.callboard("lifecycle", *verb, "/plain", *rest)
            assert (plain.code, plain.out) == (1, "")
            what = "state" if verb == ["get"] else "transitions"
            assert plain.err == (
                f"Node '/plain' has no {what}: it is no lifecycle node;"
                " `callboard lifecycle nodes` lists those that are\n"
            )
        assert await desk.callboard("lifecycle", "get") == (0, "", "")


async def test_list(desk: Desk) -> None:
    """`lifecycle list` prints possible transitions as ROS 2 does, with -a the whole graph."""
    async with Managed(desk) as node:
        await node.get_graph()
        code, out, _ = await desk.callboard("lifecycle", "list", "/managed")
        assert (code, out) == (0, dedent("""\
            - configure [1]
            \tStart: unconfigured
            \tGoal: configuring
            - shutdown [5]
            \tStart: unconfigured
            \tGoal: shuttingdown
            """))  # fmt: skip
        every = (await desk.callboard("lifecycle", "list", "-a", "/managed", "--json")).json
        assert len(every) == 25
        assert every[1] == {
            "id": 2, "label": "cleanup", "start_state": "inactive", "goal_state": "cleaningup"
        }  # fmt: skip


async def test_set(desk: Desk) -> None:
    """By label or number; what is not possible is refused with what is, and a failure is one."""
    async with Managed(desk) as node:
        await node.get_graph()
        done = await desk.callboard("lifecycle", "set", "/managed", "configure")
        assert done == (0, "Transitioning successful\n", "")
        assert node.current_state.label == "inactive"
        code, out, err = await desk.callboard("lifecycle", "set", "/managed", "configure")
        assert (code, out) == (1, "")
        assert err == (
            "Unknown transition requested, available ones are:\n"
            "- cleanup [2]\n- activate [3]\n- shutdown [6]\n"
        )
        failed = await desk.callboard("lifecycle", "set", "/managed", "2")
        assert failed == (1, "", "Transitioning failed\n")
        assert (await desk.callboard("lifecycle", "set", "/managed", "2", "--json")) == (
            1, '{"success": false}\n', ""
        )  # fmt: skip
        assert (await desk.callboard("lifecycle", "set", "/managed", "6", "--json")).json == {"success": True}
        assert node.current_state.label == "finalized"


async def test_set_ends_in_time(desk: Desk) -> None:
    """The command ends with 124 while the callback still runs; so does the transition, in its own time."""
    async with Managed(desk, stop_timeout_sec=0) as node:
        await node.trigger_configure()
        setting = desk.start("lifecycle", "set", "/managed", "activate", "--timeout", "3")
        await node.activating.wait()
        assert (await desk.callboard("lifecycle", "get", "/managed")).out == "activating [13]\n"
        assert (await setting).code == 124
        await until(lambda: node.current_state.label == "activating")


def test_completion() -> None:
    """The transitions that can be requested, each once."""
    labels = ["configure", "cleanup", "activate", "deactivate", "shutdown"]
    assert offers(["lifecycle", "set", "/managed", ""]) == [Offer(each) for each in labels]
