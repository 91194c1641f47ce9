"""`callboard service type`."""

from __future__ import annotations

from functools import partial
from typing import Final

from actors.cli.named import SERVICE, add_type_arguments, print_types

EXAMPLES: Final = {"callboard service type /add_two_ints": "its type"}
add_arguments: Final = partial(add_type_arguments, SERVICE)
run: Final = partial(print_types, SERVICE)
