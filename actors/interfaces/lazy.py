"""Lazy exports for generated packages: a message's module is imported when the message is first asked for.

`from actors.interfaces.sensor_msgs.msg import Imu` loads Imu and what it contains, not all of sensor_msgs.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable


def lazy_exports(package: str, modules: dict[str, str]) -> Callable[[str], object]:
    """Return the `__getattr__` (PEP 562) of a package whose classes live in one module each.

    Args:
        package: The package's `__name__`.
        modules: Class name to the name of its module in the package.
    """

    def get(name: str) -> object:
        module = modules.get(name)
        if module is None:
            raise AttributeError(f"module '{package}' has no attribute '{name}'")
        return getattr(import_module(f"{package}.{module}"), name)

    return get
