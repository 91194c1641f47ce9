"""`callboard node list`."""

from __future__ import annotations

from typing import TYPE_CHECKING

from actors.cli.output import say_json
from actors.cli.place import inspector
from actors.cli.tables import Styled, say_styled
from proto.names import is_hidden

if TYPE_CHECKING:
    import argparse


def run(options: argparse.Namespace) -> int:
    """Print the nodes' full names."""
    with inspector(options) as look:
        found = [name for name in look.graph().nodes() if options.all or not is_hidden(name)]
    if options.count_nodes:
        say_json(len(found))
    elif options.json:
        say_json([{"name": name} for name in found])
    else:
        for name in found:
            say_styled(Styled(name, "name"))
    return 0
