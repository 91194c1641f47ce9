"""One bridge for most tests of a pytest worker, and nodes of both sides for each test."""

from __future__ import annotations

import itertools
import os
import sys
from dataclasses import dataclass
from typing import TYPE_CHECKING

import pytest

import actors
from tests.ros2.edge import Edge
from tests.ros2.network import Network

if TYPE_CHECKING:
    from collections.abc import AsyncIterator, Callable, Iterator
    from pathlib import Path

    from tests.ros2.network import Process
    from tests.ros2.ros import Ros, RosNode

_numbers = itertools.count(1)


@dataclass(frozen=True)
class Pair:
    """A node of each side, with a bridge between them.

    Attributes:
        here: callboard's.
        there: ROS's.
        name: What the names of a test begin with, so that tests which share a bridge do not meet.
        ros: The process of ROS's node.
        network: Both networks.
    """

    here: actors.Node
    there: RosNode
    name: str
    ros: Ros
    network: Network


PATIENT = "lease_sec = 20\n"
"""Fast DDS's own lease. A process that stands still for longer than the bridge's drops the bridge, and Fast
DDS may not connect them again: after a pause of 3 s, requests to some services would be lost for ever."""


class Shared:
    """The network that tests share. Its bridge starts with the first of them."""

    def __init__(self, network: Network, folder: Path) -> None:
        self.network = network
        self.ros = network.ros()
        self._config = folder / "bridge.toml"
        self._config.write_text(PATIENT, encoding="utf-8")
        self._bridge: Process | None = None
        network.broker()

    @property
    def bridge(self) -> Process:
        """The bridge; another one if an earlier test has ended it."""
        if self._bridge is None or not self._bridge.is_alive:
            self._bridge = self.network.bridge("--config", str(self._config))
        return self._bridge


@pytest.fixture(scope="session")
def shared(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Shared]:
    """The network that tests of this worker share."""
    number = int(os.environ.get("PYTEST_XDIST_WORKER", "gw0").removeprefix("gw"))
    folder = tmp_path_factory.mktemp("bridge")
    network = Network(folder, number)
    yield Shared(network, folder)
    network.close()


@pytest.fixture
async def pair(shared: Shared) -> AsyncIterator[Pair]:
    """A node of each side of the shared bridge.

    What the bridge and the process of ROS's node have printed meanwhile is shown if the test fails.
    """
    name = f"test_{next(_numbers)}"
    bridge = shared.bridge
    bridge.output()
    shared.ros.output()
    async with actors.Node(f"{name}_here", url=shared.network.url) as here:
        there = await shared.ros.node(f"{name}_there")
        yield Pair(here, there, f"/{name}", shared.ros, shared.network)
    await shared.ros.ask("destroy_all")
    sys.stderr.write(bridge.output() + shared.ros.output())


@pytest.fixture(scope="session")
def shared_edge(shared: Shared) -> Iterator[Edge]:
    """A process with the edge of a bridge."""
    made = Edge(shared.network.environ, "tested")
    yield made
    made.close()


@pytest.fixture
async def edge(shared_edge: Edge, shared: Shared) -> AsyncIterator[Edge]:
    """The edge of a bridge, without mirrors; ROS's nodes of the test end as well."""
    yield shared_edge
    await shared_edge.reset()
    await shared.ros.ask("destroy_all")


@pytest.fixture
def ros(shared: Shared) -> Ros:
    """A process of real ROS 2 beside the edge."""
    return shared.ros


@pytest.fixture
def name() -> str:
    """What the names of a test begin with."""
    return f"test_{next(_numbers)}"


@pytest.fixture
def make_network(tmp_path: Path) -> Iterator[Callable[[], Network]]:
    """Makes networks for a test that has them to itself; nothing runs there yet."""
    made: list[Network] = []

    def make() -> Network:
        folder = tmp_path / str(len(made))
        folder.mkdir()
        made.append(Network(folder))
        return made[-1]

    yield make
    for each in made:
        each.close()


@pytest.fixture
def network(make_network: Callable[[], Network]) -> Network:
    """A network that a test has to itself; nothing runs there yet."""
    return make_network()
