"""The services of a recorder, with the names and types of ROS 2's recorder, and a report in JSON."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any, Protocol

from actors.bags.errors import BagError
from actors.bags.pause_services import Pausable, PauseServices
from actors.interfaces.rosbag2_interfaces.srv import (
    IsDiscoveryRunning,
    Snapshot,
    SplitBagfile,
    StartDiscovery,
    StopDiscovery,
)
from actors.interfaces.std_srvs.srv import Trigger

if TYPE_CHECKING:
    from actors.bags.recorder.discovery import Discovery
    from actors.node.node import Node


class Controlled(Pausable, Protocol):
    """What the services need of a recorder; its methods are documented there."""

    discovery: Discovery

    async def split(self) -> None: ...  # noqa: D102 - see above
    async def take_snapshot(self) -> int: ...  # noqa: D102
    def document(self) -> dict[str, Any]: ...  # noqa: D102


class RecorderServices:
    """Lets other nodes control a recorder.

    Args:
        node: The recorder's node.
        recorder: The recorder to control.
        has_snapshots: Whether the recorder is in snapshot mode.
    """

    def __init__(self, node: Node, recorder: Controlled, *, has_snapshots: bool) -> None:
        self._recorder = recorder
        self._log = node.get_logger()
        PauseServices(node, recorder)
        node.create_service(Trigger, "~/get_report", self._report)
        node.create_service(IsDiscoveryRunning, "~/is_discovery_running", self._is_discovery_running)
        node.create_service(StartDiscovery, "~/start_discovery", self._start_discovery)
        node.create_service(StopDiscovery, "~/stop_discovery", self._stop_discovery)
        node.create_service(SplitBagfile, "~/split_bagfile", self._split)
        if has_snapshots:
            node.create_service(Snapshot, "~/snapshot", self._snapshot)

    def _report(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        response.success, response.message = True, json.dumps(self._recorder.document())
        return response

    def _is_discovery_running(
        self, _: IsDiscoveryRunning.Request, response: IsDiscoveryRunning.Response
    ) -> IsDiscoveryRunning.Response:
        response.running = self._recorder.discovery.is_running
        return response

    def _start_discovery(
        self, _: StartDiscovery.Request, response: StartDiscovery.Response
    ) -> StartDiscovery.Response:
        if not self._recorder.discovery.start():
            response.return_code, response.error_string = 1, "Discovery is already running"
        return response

    def _stop_discovery(
        self, _: StopDiscovery.Request, response: StopDiscovery.Response
    ) -> StopDiscovery.Response:
        if not self._recorder.discovery.stop():
            response.return_code, response.error_string = 1, "Discovery is not running"
        return response

    async def _split(self, _: SplitBagfile.Request, response: SplitBagfile.Response) -> SplitBagfile.Response:
        await self._recorder.split()
        return response

    async def _snapshot(self, _: Snapshot.Request, response: Snapshot.Response) -> Snapshot.Response:
        try:
            await self._recorder.take_snapshot()
            response.success = True
        except BagError as error:
            self._log.error(f"Cannot write the snapshot: {error}")
        return response
