"""Lazy exports of generated packages: a message's module is imported when the message is first used.

`from actors.interfaces.sensor_msgs.msg import Imu` imports Imu and its fields' types, not all of sensor_msgs.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from actors.lazy import lazy_getattr

if TYPE_CHECKING:
    from collections.abc import Callable


def lazy_exports(package: str, modules: dict[str, str]) -> Callable[[str], object]:
    """Return the `__getattr__` (PEP 562) of a package whose classes live in modules below it.

    Args:
        package: The package's `__name__`.
        modules: Class name to the name of its module in the package.
    """
    return lazy_getattr(package, {name: f"{package}.{module}" for name, module in modules.items()})
