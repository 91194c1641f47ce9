"""`callboard topic type`."""

from __future__ import annotations

from functools import partial
from typing import Final

from actors.cli.named import TOPIC, add_type_arguments, print_types

EXAMPLES: Final = {
    "callboard topic type /chatter": "its type",
    "callboard topic type /chatter | callboard interface show -": "the definition of its type",
}
add_arguments: Final = partial(add_type_arguments, TOPIC)
run: Final = partial(print_types, TOPIC)
