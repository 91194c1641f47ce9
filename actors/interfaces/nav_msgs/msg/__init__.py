"""Messages of nav_msgs."""

from typing import TYPE_CHECKING

from actors.interfaces.lazy import lazy_exports

if TYPE_CHECKING:
    from actors.interfaces.nav_msgs.msg._goals import Goals
    from actors.interfaces.nav_msgs.msg._grid_cells import GridCells
    from actors.interfaces.nav_msgs.msg._map_meta_data import MapMetaData
    from actors.interfaces.nav_msgs.msg._occupancy_grid import OccupancyGrid
    from actors.interfaces.nav_msgs.msg._odometry import Odometry
    from actors.interfaces.nav_msgs.msg._path import Path
    from actors.interfaces.nav_msgs.msg._trajectory import Trajectory
    from actors.interfaces.nav_msgs.msg._trajectory_point import TrajectoryPoint

__all__ = [
    "Goals",
    "GridCells",
    "MapMetaData",
    "OccupancyGrid",
    "Odometry",
    "Path",
    "Trajectory",
    "TrajectoryPoint",
]

if not TYPE_CHECKING:
    __getattr__ = lazy_exports(
        __name__,
        {
            "Goals": "_goals",
            "GridCells": "_grid_cells",
            "MapMetaData": "_map_meta_data",
            "OccupancyGrid": "_occupancy_grid",
            "Odometry": "_odometry",
            "Path": "_path",
            "Trajectory": "_trajectory",
            "TrajectoryPoint": "_trajectory_point",
        },
    )
