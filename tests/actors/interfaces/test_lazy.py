"""Lazy exports."""

from __future__ import annotations

import subprocess
import sys

import pytest

import actors.interfaces
import actors.interfaces.std_msgs.msg as std_messages


@pytest.mark.processes
def test_one_message_loads_one_message() -> None:
    """Importing Imu leaves the rest of sensor_msgs alone."""
    code = (
        "import sys; from actors.interfaces.sensor_msgs.msg import Imu; "
        "print(sorted(m for m in sys.modules if m.startswith('actors.interfaces.sensor_msgs.msg.')), "
        "'yaml' in sys.modules)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "['actors.interfaces.sensor_msgs.msg._imu'] False"


def test_unknown_names_are_attribute_errors() -> None:
    """As in any module."""
    with pytest.raises(AttributeError, match="no attribute 'Strng'"):
        _ = std_messages.Strng  # type: ignore[attr-defined]


def test_all_exports_exist() -> None:
    """Each name in __all__ can be imported."""
    for name in actors.interfaces.__all__:
        assert getattr(actors.interfaces, name) is not None
