"""The services that a recorder and a player have in common, with the names and types of ROS 2."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

from actors.interfaces.rosbag2_interfaces.srv import IsPaused, Pause, Resume, Stop, TogglePaused

if TYPE_CHECKING:
    from actors.node.node import Node


class Pausable(Protocol):
    """What the services need of a recorder or a player; its methods are documented there."""

    @property
    def is_paused(self) -> bool: ...  # noqa: D102 - see above
    def pause(self) -> None: ...  # noqa: D102
    def resume(self) -> None: ...  # noqa: D102
    def toggle_paused(self) -> None: ...  # noqa: D102
    def stop(self) -> None: ...  # noqa: D102


class PauseServices:
    """Lets other nodes pause, resume and stop a recorder or a player.

    Args:
        node: The node that offers the services.
        controlled: What they control.
    """

    def __init__(self, node: Node, controlled: Pausable) -> None:
        self._controlled = controlled
        node.create_service(Pause, "~/pause", self._pause)
        node.create_service(Resume, "~/resume", self._resume)
        node.create_service(TogglePaused, "~/toggle_paused", self._toggle)
        node.create_service(IsPaused, "~/is_paused", self._is_paused)
        node.create_service(Stop, "~/stop", self._stop)

    def _pause(self, _: Pause.Request, response: Pause.Response) -> Pause.Response:
        self._controlled.pause()
        return response

    def _resume(self, _: Resume.Request, response: Resume.Response) -> Resume.Response:
        self._controlled.resume()
        return response

    def _toggle(self, _: TogglePaused.Request, response: TogglePaused.Response) -> TogglePaused.Response:
        self._controlled.toggle_paused()
        return response

    def _is_paused(self, _: IsPaused.Request, response: IsPaused.Response) -> IsPaused.Response:
        response.paused = self._controlled.is_paused
        return response

    def _stop(self, _: Stop.Request, response: Stop.Response) -> Stop.Response:
        self._controlled.stop()
        return response
