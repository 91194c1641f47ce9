"""Say by the exit code whether real ROS 2 can be installed here."""

from __future__ import annotations

import sys

from tests.real_ros import is_supported

sys.exit(not is_supported())
