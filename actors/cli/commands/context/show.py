"""`callboard context show`."""

from __future__ import annotations

from typing import Final

from actors.cli.parsing import Options, Parser, add_json_option

EXAMPLES: Final = {
    "callboard context show": "where commands and nodes go now, and why",
    "callboard context show robot": "where they would go with --context robot",
}


def add_arguments(parser: Parser) -> None:
    """Describe the arguments."""
    parser.add_argument("context", metavar="CONTEXT", nargs="?", help="its name; default: what counts now")
    add_json_option(parser, "{url, domain, url_from, domain_from}")


def run(options: Options) -> int:
    """Print where commands and nodes go, and what says so."""
    from actors.cli.broker_target import unknown_context
    from actors.cli.output import print_json
    from actors.cli.tables import print_table
    from actors.config.context_errors import UnknownContextError
    from actors.config.contexts import find_broker_target

    try:
        target = find_broker_target(context=options.context)
    except UnknownContextError as error:
        raise unknown_context(error) from error
    if options.json:
        fields = {**target._asdict(), "urls": [str(url) for url in target.urls]}
        del fields["credentials"]
        print_json(fields)
    else:
        print_table(
            [("url", target.url, target.url_from), ("domain", target.domain, target.domain_from)],
            style=("", "name", "dim"),
        )
    return 0
