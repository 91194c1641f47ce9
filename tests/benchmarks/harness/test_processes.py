"""The protocol between a trial and its processes, with a role that does as it is told."""

from __future__ import annotations

import os
import sys
from typing import TYPE_CHECKING

import pytest

from benchmarks.harness.contender import Contender
from benchmarks.harness.errors import TrialError
from benchmarks.harness.processes import TrialProcesses
from benchmarks.harness.trial import missing, run_trial
from benchmarks.harness.workloads import Case, Part

if TYPE_CHECKING:
    from pathlib import Path

    from benchmarks.harness.outcomes import Outcome

ROLE = """
import json, sys
parameters = json.loads(sys.argv[1])
plan = parameters.get("plan", "")

def say(event, **more):
    print(json.dumps({"event": event, **more}), flush=True)

if plan == "refuse":
    sys.exit("no such luck")
if plan == "babble":
    print("hello", flush=True)
say("ready")
go = sys.stdin.readline()
if plan == "crash":
    sys.exit("it broke")
if plan == "stay":
    sys.stdin.read()
say("done", go=go, url=parameters["url"], seconds=parameters.get("seconds"), plan=plan)
if plan == "limp":
    sys.exit(3)
"""
SERVER = """
import socket, sys
with socket.create_server(("127.0.0.1", int(sys.argv[1]))) as server:
    while True:
        server.accept()[0].close()
"""


def contender(server: str | None = None) -> Contender:
    """Someone who plays ROLE, with a server if there is code for one."""
    return Contender(
        name="fake",
        version="1",
        brokered=server is not None,
        role_command=(sys.executable, "-c", ROLE),
        server_command=None if server is None else lambda port, _: [sys.executable, "-c", server, str(port)],
        server_url=lambda port: f"fake://{port}" if server else "",
        roles=frozenset({"player"}),
    )


def case(*plans: str) -> Case:
    """A case with a role for each plan; who stays is held."""
    parts = tuple(Part(role="player", parameters={"plan": plan}, held=plan == "stay") for plan in plans)
    return Case(name="fake", parts=parts, measure=_count)


def _count(outcome: Outcome) -> dict[str, float]:
    for each in outcome.played:
        assert each.figures["go"] == "go\n"
        assert each.figures["seconds"] == 0.1
        assert each.figures["plan"] == each.parameters["plan"]
    return {"roles": len(outcome.played), "cpu": -1.0 if outcome.server_cpu_s is None else 0.0}


@pytest.mark.processes
async def test_roles_start_and_report() -> None:
    """All of them, with their own parameters; a held one when the others have ended."""
    assert await run_trial(contender(), case("", "stay", ""), 0.1) == {"roles": 3, "cpu": -1.0}


@pytest.mark.processes
async def test_a_server_is_waited_for_and_measured() -> None:
    """Roles start when it listens, and its CPU time is known."""
    assert (await run_trial(contender(SERVER), case(""), 0.1))["roles"] == 1


@pytest.mark.parametrize(
    ("plan", "text"),
    [
        ("refuse", "ended with 1 before it was ready\n    no such luck"),
        ("babble", "wrote b'hello\\n' instead of 'ready'"),
        ("crash", "ended with 1 before it was done\n    it broke"),
        ("limp", "reported and then ended with 3"),
    ],
)
@pytest.mark.processes
async def test_a_role_that_fails_fails_the_trial(plan: str, text: str) -> None:
    """With what it said last; the others are not waited for."""
    with pytest.raises(TrialError) as error:
        await run_trial(contender(), case("stay", plan), 0.1)
    assert text in str(error.value)


async def test_a_server_that_does_not_start_fails_the_trial() -> None:
    """At once, and with its last words."""
    with pytest.raises(TrialError, match="server ended with 1\n    out of order"):
        await run_trial(contender("import sys; sys.exit('out of order')"), case(""), 0.1)


@pytest.mark.processes
async def test_no_process_is_left_after_a_trial(tmp_path: Path) -> None:
    """Neither server nor roles, also by an exception."""
    pids: list[int] = []

    async def act() -> None:
        async with TrialProcesses(contender(SERVER), tmp_path) as processes:
            role = await processes.add("player", {"plan": "stay"})
            assert processes.server is not None
            pids.extend((role.pid, processes.server.pid))
            raise RuntimeError("enough")

    with pytest.raises(RuntimeError, match="enough"):
        await act()
    assert len(pids) == 2
    for pid in pids:
        with pytest.raises(ProcessLookupError):
            os.kill(pid, 0)


def test_what_a_contender_cannot_play_is_known_before() -> None:
    """By the names of the roles it lacks."""
    wanted = Case(name="", parts=(Part(role="player"), Part(role="idle")), measure=_count)
    assert missing(contender(), wanted) == ["idle"]
