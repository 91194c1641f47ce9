"""`callboard context add`."""

from __future__ import annotations

from typing import Final

from actors.cli.commands.context import print_current, use_context
from actors.cli.parsing import Options, Parser, domain
from proto.limits import MAX_DOMAIN

EXAMPLES: Final = {
    "callboard context add robot --url callboard://192.168.1.20:7411": "give a broker a name",
    "callboard context add fleet --url callboards://fleet.example --ca ca.pem": "one with TLS",
    "callboard context add lab --url callboard://lab --domain 7 --use": "one of its graphs, and go there",
}


def add_arguments(parser: Parser) -> None:
    """Describe the arguments."""
    parser.add_argument("name", metavar="NAME", help="letters, digits, - and _")
    parser.add_argument("--url", metavar="URL", required=True, help="the broker, or several with commas")
    parser.add_argument("--domain", type=domain, metavar="N", help=f"which of its graphs, 0 to {MAX_DOMAIN}")
    parser.add_argument("--description", metavar="TEXT", default="", help="one line that describes it")
    parser.add_argument("--token-file", metavar="PATH", help="file with the token that the broker requires")
    parser.add_argument("--ca", metavar="PATH", help="PEM file with the authorities to trust for TLS")
    parser.add_argument("--cert", metavar="PATH", help="PEM file with the certificate of this client")
    parser.add_argument("--key", metavar="PATH", help="PEM file with its private key")
    parser.add_flag("--use", help="go there from now on")
    parser.add_flag("--replace", help="if there is one of that name")


def run(options: Options) -> int:
    """Give a broker a name."""
    from actors.cli.errors import CommandError
    from actors.cli.output import print_out
    from actors.config.contexts import Context, Contexts

    name = options.name
    context = Context(
        url=options.url,
        domain=options.domain,
        description=options.description,
        token_file=_absolute(options.token_file),
        ca=_absolute(options.ca),
        cert=_absolute(options.cert),
        key=_absolute(options.key),
    )
    with Contexts.changing() as contexts:
        if name in contexts.named and not options.replace:
            raise CommandError(f"There is a context '{name}' already; --replace gives it another URL")
        contexts.add(name, context, replace=options.replace)
        if options.use:
            use_context(contexts, name)
    if options.use:
        print_current(contexts)
    else:
        print_out(f"Added '{name}'. To go there: callboard context use {name}")
    return 0


def _absolute(path: str | None) -> str:
    from pathlib import Path

    return str(Path(path).expanduser().absolute()) if path else ""
