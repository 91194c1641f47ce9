"""Messages of statistics_msgs."""

from typing import TYPE_CHECKING

from actors.interfaces.lazy import lazy_exports

if TYPE_CHECKING:
    from actors.interfaces.statistics_msgs.msg._metrics_message import MetricsMessage
    from actors.interfaces.statistics_msgs.msg._statistic_data_point import StatisticDataPoint
    from actors.interfaces.statistics_msgs.msg._statistic_data_type import StatisticDataType

__all__ = [
    "MetricsMessage",
    "StatisticDataPoint",
    "StatisticDataType",
]

if not TYPE_CHECKING:
    __getattr__ = lazy_exports(
        __name__,
        {
            "MetricsMessage": "_metrics_message",
            "StatisticDataPoint": "_statistic_data_point",
            "StatisticDataType": "_statistic_data_type",
        },
    )
