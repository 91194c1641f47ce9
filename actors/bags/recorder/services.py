"""The services of a recorder, with the names and types of ROS 2's recorder, and a report as JSON."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any, Protocol

from actors.bags.errors import BagError
from actors.interfaces.rosbag2_interfaces.srv import (
    IsPaused,
    Pause,
    Resume,
    Snapshot,
    SplitBagfile,
    Stop,
    TogglePaused,
)
from actors.interfaces.std_srvs.srv import Trigger

if TYPE_CHECKING:
    from actors.node.node import Node


class Controlled(Protocol):
    """What the services need of a recorder; its methods are documented there."""

    @property
    def is_paused(self) -> bool: ...  # noqa: D102 - see above
    def pause(self) -> None: ...  # noqa: D102
    def resume(self) -> None: ...  # noqa: D102
    def toggle_paused(self) -> None: ...  # noqa: D102
    def stop(self) -> None: ...  # noqa: D102
    async def split(self) -> None: ...  # noqa: D102
    async def take_snapshot(self) -> int: ...  # noqa: D102
    def document(self) -> dict[str, Any]: ...  # noqa: D102


class RecorderServices:
    """Lets other nodes control a recorder.

    Args:
        node: The recorder's node.
        recorder: What they control.
        has_snapshots: Whether it keeps messages until somebody asks for them.
    """

    def __init__(self, node: Node, recorder: Controlled, *, has_snapshots: bool) -> None:
        self._recorder = recorder
        self._log = node.get_logger()
        node.create_service(Pause, "~/pause", self._pause)
        node.create_service(Resume, "~/resume", self._resume)
        node.create_service(TogglePaused, "~/toggle_paused", self._toggle)
        node.create_service(IsPaused, "~/is_paused", self._is_paused)
        node.create_service(Stop, "~/stop", self._stop)
        node.create_service(Trigger, "~/get_report", self._report)
        node.create_service(SplitBagfile, "~/split_bagfile", self._split)
        if has_snapshots:
            node.create_service(Snapshot, "~/snapshot", self._snapshot)

    def _pause(self, _: Pause.Request, response: Pause.Response) -> Pause.Response:
        self._recorder.pause()
        return response

    def _resume(self, _: Resume.Request, response: Resume.Response) -> Resume.Response:
        self._recorder.resume()
        return response

    def _toggle(self, _: TogglePaused.Request, response: TogglePaused.Response) -> TogglePaused.Response:
        self._recorder.toggle_paused()
        return response

    def _is_paused(self, _: IsPaused.Request, response: IsPaused.Response) -> IsPaused.Response:
        response.paused = self._recorder.is_paused
        return response

    def _stop(self, _: Stop.Request, response: Stop.Response) -> Stop.Response:
        self._recorder.stop()
        return response

    def _report(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        response.success, response.message = True, json.dumps(self._recorder.document())
        return response

    async def _split(self, _: SplitBagfile.Request, response: SplitBagfile.Response) -> SplitBagfile.Response:
        await self._recorder.split()
        return response

    async def _snapshot(self, _: Snapshot.Request, response: Snapshot.Response) -> Snapshot.Response:
        try:
            await self._recorder.take_snapshot()
            response.success = True
        except BagError as error:
            self._log.error(f"The snapshot cannot be written: {error}")
        return response
