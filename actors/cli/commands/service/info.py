"""`callboard service info`."""

from __future__ import annotations

from functools import partial
from typing import Final

from actors.cli.named import SERVICE, add_info_arguments, print_info

EXAMPLES: Final = {
    "callboard service info /add_two_ints": "its type, and how many clients and servers it has",
    "callboard service info -v /add_two_ints": "also which nodes they are on",
}
add_arguments: Final = partial(add_info_arguments, SERVICE)
run: Final = partial(print_info, SERVICE)
