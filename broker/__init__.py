"""The standalone broker: routes frames by topic and service name and knows who is there.

The names below load their modules when they are first used.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from broker.errors import AddressInUseError as AddressInUseError
    from broker.errors import InvalidOptionError as InvalidOptionError
    from broker.errors import ListenError as ListenError
    from broker.options import BrokerOptions as BrokerOptions
    from broker.server import Broker as Broker
    from broker.stats import BrokerStats as BrokerStats

_HOME_OF = {
    "AddressInUseError": "broker.errors",
    "InvalidOptionError": "broker.errors",
    "ListenError": "broker.errors",
    "BrokerOptions": "broker.options",
    "Broker": "broker.server",
    "BrokerStats": "broker.stats",
}


def __getattr__(name: str) -> object:
    if name not in _HOME_OF:
        raise AttributeError(f"module 'broker' has no attribute '{name}'")
    value = getattr(import_module(_HOME_OF[name]), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *_HOME_OF})
