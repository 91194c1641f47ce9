"""`python -m actors` is `callboard`."""

from __future__ import annotations

import sys

from actors.cli.main import main

if __name__ == "__main__":
    sys.exit(main())
