"""statistics_msgs/msg/StatisticDataType."""

from typing import ClassVar

from actors.interfaces.message import Message
from actors.interfaces.types import uint8


class StatisticDataType(Message, type_name="statistics_msgs/msg/StatisticDataType"):
    """statistics_msgs/msg/StatisticDataType."""

    STATISTICS_DATA_TYPE_UNINITIALIZED: ClassVar[uint8] = 0
    STATISTICS_DATA_TYPE_AVERAGE: ClassVar[uint8] = 1
    STATISTICS_DATA_TYPE_MINIMUM: ClassVar[uint8] = 2
    STATISTICS_DATA_TYPE_MAXIMUM: ClassVar[uint8] = 3
    STATISTICS_DATA_TYPE_STDDEV: ClassVar[uint8] = 4
    STATISTICS_DATA_TYPE_SAMPLE_COUNT: ClassVar[uint8] = 5
