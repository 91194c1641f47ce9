"""The workloads as data agree with the roles, the figures and the command line."""

from __future__ import annotations

from dataclasses import replace
from importlib import import_module

import pytest

from actors.cli.commands import bench
from benchmarks.harness.own import callboard
from benchmarks.harness.roles import HELD, ROLES
from benchmarks.harness.trial import missing
from benchmarks.harness.workloads import WORKLOADS


def test_the_command_line_knows_every_workload() -> None:
    """By its id, in order."""
    assert tuple(workload.id for workload in WORKLOADS) == bench.IN_A_CHECKOUT


def test_callboard_plays_every_role() -> None:
    """And who is held is held in every case."""
    for workload in WORKLOADS:
        for case in workload.cases:
            assert missing(callboard(), case) == []
            assert [part.held for part in case.parts] == [part.role in HELD for part in case.parts]


@pytest.mark.parametrize("role", ROLES)
def test_every_role_is_where_it_is_listed(role: str) -> None:
    """Under its own name."""
    assert callable(getattr(import_module(f"benchmarks.harness.roles.{ROLES[role]}"), role))


def test_peers_are_only_asked_what_they_understand() -> None:
    """Whose roles have the same names and know nothing of message types and the like."""
    common = frozenset({"publisher", "subscriber", "server", "requester", "idle"})
    peer = replace(callboard(), name="peer", roles=common)
    played = {each.id for each in WORKLOADS for case in each.cases if not missing(peer, case)}
    assert played == {"W1", "W2", "W3", "W4", "W5"}


def test_case_names_are_unique_in_a_workload() -> None:
    """Results are found by them."""
    for workload in WORKLOADS:
        names = [case.name for case in workload.cases]
        assert len({*names}) == len(names)
