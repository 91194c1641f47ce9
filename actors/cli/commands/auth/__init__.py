"""`callboard auth`: the users of a broker, in its file of access rules."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from actors.cli.parsing import Options, Parser


def add_file_option(parser: Parser) -> None:
    """Add --file."""
    parser.add_argument(
        "--file",
        metavar="FILE",
        help="the access rules; default: callboard/access.toml in the configuration folder",
    )


def add_token_file_option(parser: Parser) -> None:
    """Add --token-file."""
    parser.add_argument(
        "--token-file",
        metavar="OUT",
        help="write the token to this file, for its owner only; default: stdout",
    )


def rules_file(options: Options) -> Path:
    """Return the file of access rules that the options choose."""
    from actors.config.environment import config_folder

    return Path(options.file) if options.file else Path(config_folder()) / "access.toml"


def hand_over(token: str, options: Options, text: str) -> None:
    """Print a token, or write it to a file, as nothing else stores it; then report the change."""
    from actors.cli.output import print_err, print_out
    from broker.access.private_file import write_private

    if options.token_file:
        write_private(Path(options.token_file), token + "\n")
        text = f"{text} The token is in {options.token_file}."
    else:
        print_out(token)
        text = f"{text} The token is shown only now."
    print_err(f"{text} A running broker reads the file again at SIGHUP.")
