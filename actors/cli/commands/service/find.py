"""`callboard service find`."""

from __future__ import annotations

from functools import partial
from typing import Final

from actors.cli.named import SERVICE, add_find_arguments, find_names

EXAMPLES: Final = {"callboard service find std_srvs/srv/Trigger": "all services of this type"}
add_arguments: Final = partial(add_find_arguments, SERVICE)
run: Final = partial(find_names, SERVICE)
