"""The standalone broker: routes frames by topic and service name, and keeps the graph. May import `proto`.

The names below load their modules when they are first used.
"""

from __future__ import annotations

import sys
from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from broker.access.errors import AccessFileError as AccessFileError
    from broker.errors import AddressInUseError as AddressInUseError
    from broker.errors import InvalidOptionError as InvalidOptionError
    from broker.errors import ListenError as ListenError
    from broker.errors import UnprotectedError as UnprotectedError
    from broker.options import BrokerOptions as BrokerOptions
    from broker.server import Broker as Broker
    from proto.wire.stats import BrokerRates as BrokerRates
    from proto.wire.stats import BrokerStats as BrokerStats
    from proto.wire.stats import LinkStats as LinkStats
    from proto.wire.stats import MeshStats as MeshStats
    from proto.wire.stats import TopicStats as TopicStats

_HOME_OF = {
    "AccessFileError": "broker.access.errors",
    "AddressInUseError": "broker.errors",
    "InvalidOptionError": "broker.errors",
    "ListenError": "broker.errors",
    "UnprotectedError": "broker.errors",
    "BrokerOptions": "broker.options",
    "Broker": "broker.server",
    "BrokerRates": "proto.wire.stats",
    "BrokerStats": "proto.wire.stats",
    "LinkStats": "proto.wire.stats",
    "MeshStats": "proto.wire.stats",
    "TopicStats": "proto.wire.stats",
}


def explained(error: ImportError) -> ImportError:
    """Return an error that names the module that hides `proto`, or the same one.

    `actors.hidden_packages` does the same for `actors`.
    """
    from pathlib import Path  # noqa: PLC0415 - after a failure only

    file = getattr(sys.modules.get("proto"), "__file__", None)
    if file is None or Path(__file__).resolve().parent.parent / "proto" in Path(file).resolve().parents:
        return error
    return ImportError(
        f"the import name 'proto' belongs to another package here: {file}\n"
        "Rename that, or install callboard into a separate environment: python -m venv",
        name=error.name,
    )


if not TYPE_CHECKING:  # with a `__getattr__` in sight, type checkers accept each misspelt name

    def __getattr__(name: str) -> object:
        if name == "__all__":  # what `from broker import *` takes
            return sorted(_HOME_OF)
        if name not in _HOME_OF:
            raise AttributeError(f"module 'broker' has no attribute '{name}'")
        try:
            value = getattr(import_module(_HOME_OF[name]), name)
        except ImportError as error:
            raise explained(error) from error.__cause__
        globals()[name] = value
        return value

    def __dir__() -> list[str]:
        return sorted({*_HOME_OF, *(name for name in globals() if name[:2] == "__"), "__all__"})
