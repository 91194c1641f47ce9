"""The services of a player, with the names and types of ROS 2's player."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

from actors.bags.errors import InvalidBagOptionError
from actors.bags.pause_services import Pausable, PauseServices
from actors.interfaces.rosbag2_interfaces.srv import Burst, GetRate, Play, PlayNext, Seek, SetRate
from actors.time.types import NANOSECONDS_PER_SECOND

if TYPE_CHECKING:
    from actors.interfaces.builtin_interfaces.msg import Duration, Time
    from actors.node.node import Node


class Controlled(Pausable, Protocol):
    """What the services need of a player; its methods are documented there."""

    @property
    def rate(self) -> float: ...  # noqa: D102 - see above
    def set_rate(self, rate: float) -> None: ...  # noqa: D102
    def seek(self, time_ns: int) -> bool: ...  # noqa: D102
    def play(  # noqa: D102
        self, *, start_offset_ns: int = 0, duration_ns: int | None = None, until_ns: int | None = None
    ) -> bool: ...
    async def play_next(self) -> bool: ...  # noqa: D102
    async def burst(self, count: int = 0) -> int: ...  # noqa: D102


class PlayerServices:
    """Offers the services.

    Args:
        node: The player's node.
        player: The player to control.
    """

    def __init__(self, node: Node, player: Controlled) -> None:
        self._player = player
        PauseServices(node, player)
        node.create_service(SetRate, "~/set_rate", self._set_rate)
        node.create_service(GetRate, "~/get_rate", self._get_rate)
        node.create_service(Play, "~/play", self._play)
        node.create_service(PlayNext, "~/play_next", self._play_next)
        node.create_service(Burst, "~/burst", self._burst)
        node.create_service(Seek, "~/seek", self._seek)

    def _set_rate(self, request: SetRate.Request, response: SetRate.Response) -> SetRate.Response:
        try:
            self._player.set_rate(request.rate)
            response.success = True
        except InvalidBagOptionError:
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


def _ns(moment: Time | Duration) -> int:
    return moment.sec * NANOSECONDS_PER_SECOND + moment.nanosec
