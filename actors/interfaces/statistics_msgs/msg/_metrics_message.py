"""statistics_msgs/msg/MetricsMessage."""

import msgspec

from actors.interfaces.builtin_interfaces.msg._time import Time
from actors.interfaces.message import Message
from actors.interfaces.statistics_msgs.msg._statistic_data_point import StatisticDataPoint


class MetricsMessage(Message, type_name="statistics_msgs/msg/MetricsMessage"):
    """statistics_msgs/msg/MetricsMessage."""

    measurement_source_name: str = ""
    metrics_source: str = ""
    unit: str = ""
    window_start: Time = msgspec.field(default_factory=Time)
    window_stop: Time = msgspec.field(default_factory=Time)
    statistics: list[StatisticDataPoint] = msgspec.field(default_factory=list[StatisticDataPoint])
