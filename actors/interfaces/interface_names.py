"""Rules for the names of interfaces and of their packages. The import finder needs them: no slow import."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from collections.abc import Callable

KINDS: Final = ("msg", "srv", "action")
"""The kinds of interfaces, which are the names of their folders."""
PACKAGE_NAME: Final = re.compile(r"(?!.*__)(?!.*_$)[a-z][a-z0-9_]*")
TYPE_NAME: Final = re.compile(r"[A-Z][A-Za-z0-9]*")
DERIVED_NAME: Final = re.compile(r"[A-Z][A-Za-z0-9]*(?:_[A-Z][A-Za-z]*)+")
"""The name of a message that ROS 2 derives from a service or an action, such as AddTwoInts_Request."""


def package_of_name(name: str, package: str, has_header: Callable[[], bool]) -> str:
    """Return the package of a message that a field names without one.

    It is the field's own. ROS 1's rule for `Header` remains where there is no such message, which ROS 2
    refuses.

    Args:
        name: The message's name.
        package: The package that the field is in.
        has_header: Returns whether that package has a message `Header`.
    """
    return "std_msgs" if name == "Header" and not has_header() else package
