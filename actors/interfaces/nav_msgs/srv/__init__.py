"""Services of nav_msgs."""

from typing import TYPE_CHECKING

from actors.interfaces.lazy import lazy_exports

if TYPE_CHECKING:
    from actors.interfaces.nav_msgs.srv._get_map import GetMap
    from actors.interfaces.nav_msgs.srv._get_plan import GetPlan
    from actors.interfaces.nav_msgs.srv._load_map import LoadMap
    from actors.interfaces.nav_msgs.srv._set_map import SetMap

__all__ = [
    "GetMap",
    "GetPlan",
    "LoadMap",
    "SetMap",
]

if not TYPE_CHECKING:
    __getattr__ = lazy_exports(
        __name__,
        {
            "GetMap": "_get_map",
            "GetPlan": "_get_plan",
            "LoadMap": "_load_map",
            "SetMap": "_set_map",
        },
    )
