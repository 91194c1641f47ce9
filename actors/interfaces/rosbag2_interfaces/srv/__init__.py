"""Services of rosbag2_interfaces."""

from typing import TYPE_CHECKING

from actors.interfaces.lazy import lazy_exports

if TYPE_CHECKING:
    from actors.interfaces.rosbag2_interfaces.srv._burst import Burst
    from actors.interfaces.rosbag2_interfaces.srv._get_rate import GetRate
    from actors.interfaces.rosbag2_interfaces.srv._is_discovery_running import IsDiscoveryRunning
    from actors.interfaces.rosbag2_interfaces.srv._is_paused import IsPaused
    from actors.interfaces.rosbag2_interfaces.srv._pause import Pause
    from actors.interfaces.rosbag2_interfaces.srv._play import Play
    from actors.interfaces.rosbag2_interfaces.srv._play_next import PlayNext
    from actors.interfaces.rosbag2_interfaces.srv._resume import Resume
    from actors.interfaces.rosbag2_interfaces.srv._seek import Seek
    from actors.interfaces.rosbag2_interfaces.srv._set_rate import SetRate
    from actors.interfaces.rosbag2_interfaces.srv._snapshot import Snapshot
    from actors.interfaces.rosbag2_interfaces.srv._split_bagfile import SplitBagfile
    from actors.interfaces.rosbag2_interfaces.srv._start_discovery import StartDiscovery
    from actors.interfaces.rosbag2_interfaces.srv._stop import Stop
    from actors.interfaces.rosbag2_interfaces.srv._stop_discovery import StopDiscovery
    from actors.interfaces.rosbag2_interfaces.srv._toggle_paused import TogglePaused

__all__ = [
    "Burst",
    "GetRate",
    "IsDiscoveryRunning",
    "IsPaused",
    "Pause",
    "Play",
    "PlayNext",
    "Resume",
    "Seek",
    "SetRate",
    "Snapshot",
    "SplitBagfile",
    "StartDiscovery",
    "Stop",
    "StopDiscovery",
    "TogglePaused",
]

if not TYPE_CHECKING:
    __getattr__ = lazy_exports(
        __name__,
        {
            "Burst": "_burst",
            "GetRate": "_get_rate",
            "IsDiscoveryRunning": "_is_discovery_running",
            "IsPaused": "_is_paused",
            "Pause": "_pause",
            "Play": "_play",
            "PlayNext": "_play_next",
            "Resume": "_resume",
            "Seek": "_seek",
            "SetRate": "_set_rate",
            "Snapshot": "_snapshot",
            "SplitBagfile": "_split_bagfile",
            "StartDiscovery": "_start_discovery",
            "Stop": "_stop",
            "StopDiscovery": "_stop_discovery",
            "TogglePaused": "_toggle_paused",
        },
    )
