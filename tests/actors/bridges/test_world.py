"""Bridges in a simulated world: nothing crosses twice or comes back, and what is shown becomes right."""

from __future__ import annotations

from random import Random
from typing import TYPE_CHECKING, Final

import pytest

from tests.actors.bridges.world import LEASE, STEP_SEC, World

if TYPE_CHECKING:
    from collections.abc import Iterable

    from tests.actors.bridges.world import Network

SEEDS: Final = range(3)
NAMES: Final = tuple(f"/n{index}" for index in range(5))
"""Names of nodes on all networks: the same ones, so that nodes and mirrors share them."""
TOPICS: Final = ("/a", "/b", "/c")
TAKEOVER_SEC: Final = 5.0


@pytest.fixture(params=SEEDS)
def world(request: pytest.FixtureRequest) -> World:
    """Return an empty world with a seed of its own."""
    return World(Random(request.param), request.param)


def add_pair(world: World, *networks: Network) -> None:
    """Add to each network a node that publishes its own topic, and one that subscribes to those of all."""
    topics = " ".join(f"/from_{network.name}" for network in networks)
    for network in networks:
        world.node(network, "/talker", publishes=f"/from_{network.name}")
        world.node(network, "/listener", subscribes=topics)


def churn(world: World, networks: Iterable[Network], seconds: float) -> None:
    """Let nodes and endpoints of some networks come and go."""
    for _ in range(round(seconds / STEP_SEC)):
        for network in networks:
            if world.random.randrange(5) == 0:
                name = world.random.choice(NAMES)
                if name in network.natives and world.random.randrange(2):
                    del network.natives[name]
                elif world.random.randrange(2):
                    world.node(network, name, publishes=world.random.choice(TOPICS))
                else:
                    world.node(network, name, subscribes=world.random.choice(TOPICS))
        world.step()


def test_a_bridge_connects_two_networks(world: World) -> None:
    """Each subscription gets each message of both networks once."""
    mesh, robot = world.network("mesh", is_ours=True), world.network("robot")
    add_pair(world, mesh, robot)
    world.bridge("a", mesh, robot)
    world.settle()
    for network in (mesh, robot):
        for topic in ("/from_mesh", "/from_robot"):
            assert world.reached(network, "/listener", topic) > 10


@pytest.mark.parametrize("ids", ["ab", "ba"])
@pytest.mark.parametrize("gap_sec", [0, 0.1, 0.3, 1, 10])
def test_two_bridges_of_one_network(world: World, ids: str, gap_sec: float) -> None:
    """One of two bridges between the same networks is active, in whatever order they start."""
    mesh, robot = world.network("mesh", is_ours=True), world.network("robot")
    add_pair(world, mesh, robot)
    world.run(1)
    first = world.bridge(ids[0], mesh, robot)
    world.run(gap_sec)
    second = world.bridge(ids[1], mesh, robot)
    world.settle()
    world.require(len(world.active(first, second)) == 1, "not one bridge is active")
    assert world.reached(mesh, "/listener", "/from_robot") > 10
    assert world.reached(robot, "/listener", "/from_mesh") > 10


def test_the_other_bridge_takes_over(world: World) -> None:
    """If the active bridge is killed, another takes over before the network has forgotten the killed one."""
    mesh, robot = world.network("mesh", is_ours=True), world.network("robot")
    add_pair(world, mesh, robot)
    bridges = [world.bridge(each, mesh, robot) for each in world.random.sample(["a", "b", "c"], 3)]
    world.settle()
    (killed,) = world.active(*bridges)
    killed_at = world.now
    world.kill(killed)
    world.run(LEASE * STEP_SEC / 2)
    (active,) = world.active(*bridges)
    assert active.active_since is not None
    world.require(active.active_since - killed_at <= TAKEOVER_SEC, "nobody has taken over")
    world.require(killed.id in robot.bridges, "the lease has ended")
    world.settle()
    assert world.reached(mesh, "/listener", "/from_robot") > 10
    assert world.reached(robot, "/listener", "/from_mesh") > 10


def test_one_graph_and_two_networks(world: World) -> None:
    """Two bridges of one callboard graph connect it to two networks, and not these with each other."""
    mesh, robot, arm = world.network("mesh", is_ours=True), world.network("robot"), world.network("arm")
    add_pair(world, mesh, robot, arm)
    both = world.bridge("a", mesh, robot, "ros2/1"), world.bridge("b", mesh, arm, "ros2/2")
    world.settle()
    assert len(world.active(*both)) == 2
    for topic in ("/from_mesh", "/from_robot", "/from_arm"):
        assert world.reached(mesh, "/listener", topic) > 10
    assert world.reached(robot, "/listener", "/from_mesh") > 10
    assert world.reached(arm, "/listener", "/from_mesh") > 10
    assert not world.reached(arm, "/listener", "/from_robot")


def test_two_networks_of_one_name(world: World) -> None:
    """Networks with one domain number that do not touch have an active bridge each."""
    mesh, robot, arm = world.network("mesh", is_ours=True), world.network("robot"), world.network("arm")
    add_pair(world, mesh, robot, arm)
    both = world.bridge("a", mesh, robot), world.bridge("b", mesh, arm)
    world.settle()
    assert len(world.active(*both)) == 2
    assert world.reached(robot, "/listener", "/from_mesh") > 10
    assert world.reached(arm, "/listener", "/from_mesh") > 10


def test_two_graphs_at_one_network(world: World) -> None:
    """Bridges of two callboard graphs at one network are both active, and show no mirrors of each other."""
    lab, office, robot = (
        world.network("lab", is_ours=True),
        world.network("office", is_ours=True),
        world.network("robot"),
    )
    add_pair(world, lab, office, robot)
    both = world.bridge("a", lab, robot), world.bridge("b", office, robot)
    world.settle()
    assert len(world.active(*both)) == 2
    for network in (lab, office):
        assert world.reached(network, "/listener", "/from_robot") > 10
    for topic in ("/from_lab", "/from_office"):
        assert world.reached(robot, "/listener", topic) > 10
    assert not world.reached(office, "/listener", "/from_lab")


def test_a_ring(world: World) -> None:
    """In a ring of bridges a message crosses to the next networks, and never comes back."""
    mesh, other = world.network("mesh", is_ours=True), world.network("other", is_ours=True)
    robot, arm = world.network("robot"), world.network("arm")
    add_pair(world, mesh, robot, other, arm)
    for bridge_id, (ours, theirs) in enumerate([(mesh, robot), (other, robot), (other, arm), (mesh, arm)]):
        world.bridge(str(bridge_id), ours, theirs, f"ros2/{theirs.name}")
    world.settle()
    for network, neighbours in ((mesh, (robot, arm)), (robot, (mesh, other))):
        for neighbour in neighbours:
            assert world.reached(network, "/listener", f"/from_{neighbour.name}") > 10
    assert not world.reached(arm, "/listener", "/from_robot")


@pytest.mark.parametrize("seed", range(6))
def test_churn(seed: int) -> None:
    """While nodes and bridges come and go nothing is doubled, and afterwards all sides are right."""
    world = World(Random(seed), seed)
    mesh, other = world.network("mesh", is_ours=True), world.network("other", is_ours=True)
    robot, arm = world.network("robot"), world.network("arm")
    networks = (mesh, other, robot, arm)
    names = iter(world.random.sample(range(100, 999), 40))
    sides = [(mesh, robot), (mesh, robot), (other, robot), (other, arm), (mesh, arm)]
    for ours, theirs in sides:
        world.bridge(str(next(names)), ours, theirs, f"ros2/{theirs.name}")
    for _ in range(4):
        churn(world, networks, 5)
        if world.random.randrange(2):
            killed = world.random.choice(world.bridges)
            world.kill(killed)
            churn(world, networks, world.random.choice([0, 1, 6]))
            world.bridge(str(next(names)), killed.ours, killed.theirs, killed.network)
        else:
            cut_off = world.random.choice(world.bridges)
            world.cut_off(cut_off)
            churn(world, networks, world.random.choice([0, 1, 6]))
            world.reconnect(cut_off)
    world.settle()
    for ours, theirs in set(sides):
        bridges = [each for each in world.bridges if (each.ours, each.theirs) == (ours, theirs)]
        world.require(len(world.active(*bridges)) == 1, f"not one bridge of {ours.name} and {theirs.name}")
