"""`python -m broker`: the daemon."""

from __future__ import annotations

import argparse
import sys

from broker import explained

try:
    from broker.daemon.command import add_arguments, run
except ImportError as error:
    raise explained(error) from error.__cause__


def main() -> int:
    """Read the command line and run the daemon; return the exit code."""
    parser = argparse.ArgumentParser(
        prog="python -m broker",
        description="Route messages between callboard nodes.",
        epilog="example: python -m broker --port 7411",
    )
    add_arguments(parser)
    return run(parser.parse_args())


if __name__ == "__main__":
    sys.exit(main())
