"""The standalone broker: routes frames by topic and service name and knows who is there.

The names below load their modules when they are first used.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from proto.lazy import lazy_names

if TYPE_CHECKING:
    from broker.errors import AddressInUseError as AddressInUseError
    from broker.errors import InvalidOptionError as InvalidOptionError
    from broker.errors import ListenError as ListenError
    from broker.options import BrokerOptions as BrokerOptions
    from broker.server import Broker as Broker
    from proto.stats import BrokerRates as BrokerRates
    from proto.stats import BrokerStats as BrokerStats
    from proto.stats import LinkStats as LinkStats
    from proto.stats import TopicStats as TopicStats

__getattr__, __dir__ = lazy_names(
    __name__,
    {
        "broker.errors": (
            "AddressInUseError",
            "InvalidOptionError",
            "ListenError",
        ),
        "broker.options": ("BrokerOptions",),
        "broker.server": ("Broker",),
        "proto.stats": (
            "BrokerRates",
            "BrokerStats",
            "LinkStats",
            "TopicStats",
        ),
    },
)
