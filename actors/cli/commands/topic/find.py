"""`callboard topic find`."""

from __future__ import annotations

from functools import partial
from typing import Final

from actors.cli.named import TOPIC, add_find_arguments, find_names

EXAMPLES: Final = {"callboard topic find std_msgs/msg/String": "all topics of this type"}
add_arguments: Final = partial(add_find_arguments, TOPIC)
run: Final = partial(find_names, TOPIC)
