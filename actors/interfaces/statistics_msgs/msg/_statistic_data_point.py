"""statistics_msgs/msg/StatisticDataPoint."""

from actors.interfaces.message import Message
from actors.interfaces.types import float64, uint8


class StatisticDataPoint(Message, type_name="statistics_msgs/msg/StatisticDataPoint"):
    """statistics_msgs/msg/StatisticDataPoint."""

    data_type: uint8 = 0
    data: float64 = 0.0
