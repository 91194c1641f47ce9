"""`callboard action find`."""

from __future__ import annotations

from functools import partial
from typing import Final

from actors.cli.named import ACTION, add_find_arguments, find_names

EXAMPLES: Final = {"callboard action find example_interfaces/action/Fibonacci": "all actions of this type"}
add_arguments: Final = partial(add_find_arguments, ACTION)
run: Final = partial(find_names, ACTION)
