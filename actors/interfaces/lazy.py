"""Lazy exports of generated packages: a message's module is imported when the message is first used.

`from actors.interfaces.sensor_msgs.msg import Imu` imports Imu and its fields' types, not all of sensor_msgs.
"""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING, Any

from actors.lazy import lazy_getattr

if TYPE_CHECKING:
    from collections.abc import Callable

_LISTED = {
    "srv": ("Request", "Response", "Event"),
    "action": tuple(
        f"{service}_{part}"
        for service in ("SendGoal", "GetResult")
        for part in ("Request", "Response", "Event")
    ),
}
"""What ROS 2's packages have of a service or an action; `SetBool_Request` is `SetBool.Request`."""
_UNLISTED = {"action": ("Goal", "Result", "Feedback", "FeedbackMessage", "SendGoal", "GetResult")}
"""What the modules in them have, too."""
_ATTRIBUTES = {
    "FeedbackMessage": "Impl.FeedbackMessage",
    "SendGoal": "Impl.SendGoalService",
    "GetResult": "Impl.GetResultService",
}
"""Where callboard's class has a part, if not under its own name."""


def lazy_exports(package: str, modules: dict[str, str]) -> Callable[[str], object]:
    """Return the `__getattr__` (PEP 562) of a package whose classes live in modules below it.

    The package gets a `__dir__`, too. Both know ROS 2's names for the parts of services and actions.

    Args:
        package: The package's `__name__`.
        modules: Class name to the name of its module in the package.
    """
    get = lazy_getattr(package, {name: f"{package}.{module}" for name, module in modules.items()})
    kind = package.rpartition(".")[2]
    listed = _LISTED.get(kind, ())
    parts = (*listed, *_UNLISTED.get(kind, ()))

    def get_name(name: str) -> object:
        owner, _, part = name.partition("_")
        if name in modules or owner not in modules or part not in parts:
            return get(name)
        value: Any = get(owner)
        head, _, tail = part.partition("_")
        for attribute in [*_ATTRIBUTES.get(head, head).split("."), *filter(None, [tail])]:
            value = getattr(value, attribute)
        setattr(sys.modules[package], name, value)
        return value

    def names() -> list[str]:
        derived = (f"{name}_{part}" for name in modules for part in listed)
        return sorted({*vars(sys.modules[package]), *modules, *derived})

    vars(sys.modules[package])["__dir__"] = names
    return get_name
