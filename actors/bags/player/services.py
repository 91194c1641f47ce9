"""The services of a player, with the names and types of ROS 2's player."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, Protocol

from actors.bags.player.errors import InvalidPlayingError
from actors.interfaces.rosbag2_interfaces.srv import (
    Burst,
    GetRate,
    IsPaused,
    Pause,
    Play,
    PlayNext,
    Resume,
    Seek,
    SetRate,
    Stop,
    TogglePaused,
)

if TYPE_CHECKING:
    from actors.interfaces.builtin_interfaces.msg import Duration, Time
    from actors.node.node import Node

_NS_PER_SEC: Final = 10**9


class Controlled(Protocol):
    """What the services control."""

    @property
    def is_paused(self) -> bool:
        """Whether messages wait."""
        ...

    @property
    def rate(self) -> float:
        """Seconds of the bag for each second."""
        ...

    def pause(self) -> None:
        """Publish nothing from now on."""
        ...

    def resume(self) -> None:
        """Go on."""
        ...

    def toggle_paused(self) -> None:
        """Pause, or resume."""
        ...

    def stop(self) -> None:
        """End the playing."""
        ...

    def set_rate(self, rate: float) -> None:
        """Go on with another rate, or raise InvalidPlayingError."""
        ...

    def seek(self, time_ns: int) -> bool:
        """Go to a time of the bag; return whether it has that time."""
        ...

    def play(
        self, *, start_offset_ns: int = 0, duration_ns: int | None = None, until_ns: int | None = None
    ) -> bool:
        """Play again, after the end; return whether it does."""
        ...

    async def play_next(self) -> bool:
        """Publish the next message while paused; return whether there was one."""
        ...

    async def burst(self, count: int = 0) -> int:
        """Publish the next messages while paused; return their number."""
        ...


class PlayerServices:
    """Offers the services.

    Args:
        node: The player's node.
        player: What they control.
    """

    def __init__(self, node: Node, player: Controlled) -> None:
        self._player = player
        node.create_service(Pause, "~/pause", self._pause)
        node.create_service(Resume, "~/resume", self._resume)
        node.create_service(TogglePaused, "~/toggle_paused", self._toggle)
        node.create_service(IsPaused, "~/is_paused", self._is_paused)
        node.create_service(SetRate, "~/set_rate", self._set_rate)
        node.create_service(GetRate, "~/get_rate", self._get_rate)
        node.create_service(Play, "~/play", self._play)
        node.create_service(PlayNext, "~/play_next", self._play_next)
        node.create_service(Burst, "~/burst", self._burst)
        node.create_service(Seek, "~/seek", self._seek)
        node.create_service(Stop, "~/stop", self._stop)

    def _pause(self, _: Pause.Request, response: Pause.Response) -> Pause.Response:
        self._player.pause()
        return response

    def _resume(self, _: Resume.Request, response: Resume.Response) -> Resume.Response:
        self._player.resume()
        return response

    def _toggle(self, _: TogglePaused.Request, response: TogglePaused.Response) -> TogglePaused.Response:
        self._player.toggle_paused()
        return response

    def _is_paused(self, _: IsPaused.Request, response: IsPaused.Response) -> IsPaused.Response:
        response.paused = self._player.is_paused
        return response

    def _set_rate(self, request: SetRate.Request, response: SetRate.Response) -> SetRate.Response:
        try:
            self._player.set_rate(request.rate)
            response.success = True
        except InvalidPlayingError:
            response.success = False
        return response

    def _get_rate(self, _: GetRate.Request, response: GetRate.Response) -> GetRate.Response:
        response.rate = self._player.rate
        return response

    def _play(self, request: Play.Request, response: Play.Response) -> Play.Response:
        duration_ns, until_ns = _ns(request.playback_duration), _ns(request.playback_until_timestamp)
        response.success = self._player.play(
            start_offset_ns=_ns(request.start_offset),
            duration_ns=None if duration_ns < 0 else duration_ns,
            until_ns=None if until_ns < 0 else until_ns,
        )
        return response

    async def _play_next(self, _: PlayNext.Request, response: PlayNext.Response) -> PlayNext.Response:
        response.success = await self._player.play_next()
        return response

    async def _burst(self, request: Burst.Request, response: Burst.Response) -> Burst.Response:
        response.actually_burst = await self._player.burst(request.num_messages)
        return response

    def _seek(self, request: Seek.Request, response: Seek.Response) -> Seek.Response:
        response.success = self._player.seek(_ns(request.time))
        return response

    def _stop(self, _: Stop.Request, response: Stop.Response) -> Stop.Response:
        self._player.stop()
        return response


def _ns(moment: Time | Duration) -> int:
    return moment.sec * _NS_PER_SEC + moment.nanosec
