"""`callboard bag list`: the formats of bags."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from actors.cli.parsing import Options, Parser

EXAMPLES: Final = {"callboard bag list storage": "the formats of files that are read and written"}
_LISTS: Final = {
    "storage": {"mcap": "read and written", "sqlite3": "read; callboard bag convert writes it as mcap"},
    "converter": {"cdr": "the encoding of messages, read and written"},
    "compressor": {"zstd": "for the chunks of files", "lz4": "for the chunks of files"},
    "decompressor": {"zstd": "for chunks, messages and whole files", "lz4": "for chunks"},
}


def add_arguments(parser: Parser) -> None:
    """Describe the arguments."""
    parser.add_argument("plugin_type", choices=tuple(_LISTS), help="what to list")
    parser.add_flag("-v", "--verbose", help="also say what each is for")


def run(options: Options) -> int:
    """Print the names."""
    from actors.cli.output import print_out

    for name, use in _LISTS[options.plugin_type].items():
        print_out(f"{name}: {use}" if options.verbose else name)
    return 0
