"""`callboard topic info`."""

from __future__ import annotations

from functools import partial
from typing import Final

from actors.cli.named import TOPIC, add_info_arguments, print_info

EXAMPLES: Final = {
    "callboard topic info /chatter": "its type, and how many publishers and subscriptions it has",
    "callboard topic info -v /chatter": "also which nodes they are on, and their QoS",
}
add_arguments: Final = partial(add_info_arguments, TOPIC)
run: Final = partial(print_info, TOPIC)
