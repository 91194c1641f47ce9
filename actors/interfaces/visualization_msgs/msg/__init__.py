"""Messages of visualization_msgs."""

from typing import TYPE_CHECKING

from actors.interfaces.lazy import lazy_exports

if TYPE_CHECKING:
    from actors.interfaces.visualization_msgs.msg._image_marker import ImageMarker
    from actors.interfaces.visualization_msgs.msg._interactive_marker import InteractiveMarker
    from actors.interfaces.visualization_msgs.msg._interactive_marker_control import InteractiveMarkerControl
    from actors.interfaces.visualization_msgs.msg._interactive_marker_feedback import (
        InteractiveMarkerFeedback,
    )
    from actors.interfaces.visualization_msgs.msg._interactive_marker_init import InteractiveMarkerInit
    from actors.interfaces.visualization_msgs.msg._interactive_marker_pose import InteractiveMarkerPose
    from actors.interfaces.visualization_msgs.msg._interactive_marker_update import InteractiveMarkerUpdate
    from actors.interfaces.visualization_msgs.msg._marker import Marker
    from actors.interfaces.visualization_msgs.msg._marker_array import MarkerArray
    from actors.interfaces.visualization_msgs.msg._menu_entry import MenuEntry
    from actors.interfaces.visualization_msgs.msg._mesh_file import MeshFile
    from actors.interfaces.visualization_msgs.msg._uv_coordinate import UVCoordinate

__all__ = [
    "ImageMarker",
    "InteractiveMarker",
    "InteractiveMarkerControl",
    "InteractiveMarkerFeedback",
    "InteractiveMarkerInit",
    "InteractiveMarkerPose",
    "InteractiveMarkerUpdate",
    "Marker",
    "MarkerArray",
    "MenuEntry",
    "MeshFile",
    "UVCoordinate",
]

if not TYPE_CHECKING:
    __getattr__ = lazy_exports(
        __name__,
        {
            "ImageMarker": "_image_marker",
            "InteractiveMarker": "_interactive_marker",
            "InteractiveMarkerControl": "_interactive_marker_control",
            "InteractiveMarkerFeedback": "_interactive_marker_feedback",
            "InteractiveMarkerInit": "_interactive_marker_init",
            "InteractiveMarkerPose": "_interactive_marker_pose",
            "InteractiveMarkerUpdate": "_interactive_marker_update",
            "Marker": "_marker",
            "MarkerArray": "_marker_array",
            "MenuEntry": "_menu_entry",
            "MeshFile": "_mesh_file",
            "UVCoordinate": "_uv_coordinate",
        },
    )
