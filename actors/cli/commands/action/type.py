"""`callboard action type`."""

from __future__ import annotations

from functools import partial
from typing import Final

from actors.cli.named import ACTION, add_type_arguments, print_types

EXAMPLES: Final = {"callboard action type /fibonacci": "its type"}
add_arguments: Final = partial(add_type_arguments, ACTION)
run: Final = partial(print_types, ACTION)
