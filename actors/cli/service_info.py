"""`callboard service info`."""

from __future__ import annotations

from typing import TYPE_CHECKING

from actors.cli.endpoints import document, say_info
from actors.cli.names import service_name, unknown
from actors.cli.output import say_json
from actors.cli.place import inspector
from proto.codes import EntryKind

if TYPE_CHECKING:
    import argparse


def run(options: argparse.Namespace) -> int:
    """Print a service's type, and who serves and calls it."""
    name = service_name(options.service)
    with inspector(options) as look:
        picture = look.graph()
    types = dict(picture.names_and_types(EntryKind.SERVICE, EntryKind.CLIENT))
    if name not in types:
        raise unknown(f"Unknown service '{name}'", name, types)
    clients = picture.endpoints(EntryKind.CLIENT, name)
    servers = picture.endpoints(EntryKind.SERVICE, name)
    if options.json:
        say_json(
            {
                "name": name,
                "types": types[name],
                "clients": [document(each) for each in clients],
                "servers": [document(each) for each in servers],
            }
        )
    else:
        say_info(types[name], {"Clients count": clients, "Services count": servers}, verbose=options.verbose)
    return 0
