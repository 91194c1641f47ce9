"""`callboard completion`."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from actors.cli.parsing import Options, Parser

EXAMPLES: Final = {
    "callboard completion bash": "in ~/.bashrc: source <(callboard completion bash)",
    "callboard completion zsh": "in ~/.zshrc, behind compinit: source <(callboard completion zsh)",
    "callboard completion fish": "in ~/.config/fish/config.fish: callboard completion fish | source",
}


def add_arguments(parser: Parser) -> None:
    """Describe the arguments; the hidden ones are for the scripts."""
    parser.add_argument("shell", choices=("bash", "zsh", "fish"), help="the shell to print a script for")
    parser.add_argument("--line", help=argparse.SUPPRESS)
    parser.add_argument("--words", nargs=argparse.REMAINDER, help=argparse.SUPPRESS)


def run(options: Options) -> int:
    """Run it."""
    from actors.cli import completion

    return completion.run(options)
