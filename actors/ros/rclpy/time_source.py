"""Names of simulated time: a node follows `/clock` while its parameter `use_sim_time` is set."""

from __future__ import annotations

from typing import Final

CLOCK_TOPIC: Final = "/clock"
USE_SIM_TIME_NAME: Final = "use_sim_time"
