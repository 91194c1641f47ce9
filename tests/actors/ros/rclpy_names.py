"""The reference of `rclpy` as Markdown, from the table beside this module.

python -m tests.actors.ros.rclpy_names > docs/reference/rclpy.md

For each module of rclpy the table, `rclpy_names.yaml`, has the names that are the same here, those that
differ or are absent, with the difference or the reason, and `own`: names that only callboard has. An absent
class includes its methods. A module without names is callboard's own and not for programs.

The differences in behaviour are those of `tests/real_ros/differences.py`, and the tests of rclpy's own that
fail are those of `tests/upstream/rclpy_listed.py`.
"""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Final, cast

from actors.interfaces.yaml_reader import load_yaml
from tests.real_ros import differences
from tests.upstream import rclpy_listed

TABLE: Final = Path(__file__).with_suffix(".yaml")
STATUSES: Final = ("same", "differs", "absent", "own")

_HEAD: Final = """\
# rclpy

What programs written for ROS 2 ([the guide](../how-to/ros-programs.md)) can use: the public names of
rclpy 9.1, by module.

- **same**: is there, and no difference is known.
- **differs**: is there, with the difference that the table says.
- **absent**: using it raises `AttributeError`, or `ImportError` for a module.
- **own**: callboard's addition, for its other modules; ROS 2's rclpy does not have it.

The texts of errors and warnings are callboard's own.

Names that a module of rclpy only imports, such as `Parameter` of `rclpy.node`, are there but not listed.
"""
_BEHAVIOUR: Final = """\
## Behaviour

Tests give the same programs, values and files to callboard and to real ROS 2 (rclpy 9.1.2), and compare the
answers. These are different on purpose:
"""
_TESTS: Final = """\
## Tests of rclpy

Of the tests of rclpy 8.0 that pass on rclpy 9.1.2, callboard passes those that are not listed here:
"""


@cache
def table() -> dict[str, dict[str, dict[str, str]]]:
    """Return by module and status the names, each with what differs, or why."""
    document = cast("dict[str, dict[str, list[str] | dict[str, str]]]", load_yaml(TABLE.read_bytes()))
    return {
        module: {
            status: names if isinstance(names, dict) else dict.fromkeys(names, "")
            for status, names in statuses.items()
        }
        for module, statuses in document.items()
    }


def reference() -> str:
    """Return the reference as Markdown."""
    modules = table()
    total = {status: sum(len(each.get(status, ())) for each in modules.values()) for status in STATUSES}
    numbers = ", ".join(f"{total[status]} {status}" for status in STATUSES[:3])
    parts = [_HEAD, f"Of rclpy's names: {numbers}.\n", _BEHAVIOUR, differences.reference()]
    parts += [_TESTS, rclpy_listed.reference()]
    for module, statuses in modules.items():
        if not statuses:
            continue
        parts.append(f"## {module}\n")
        for status in STATUSES:
            names = statuses.get(status, {})
            if status in {"same", "own"} and names:
                parts.append(f"{status}: {', '.join(f'`{name}`' for name in names)}\n")
            elif names:
                rows = [f"| `{name}` | {why} |" for name, why in names.items()]
                parts.append("\n".join([f"| {status} | |", "|---|---|", *rows]) + "\n")
    return "\n".join(parts)


if __name__ == "__main__":
    print(reference(), end="")  # noqa: T201 - its purpose
