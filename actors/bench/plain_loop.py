"""Runs a module as on a platform without uvloop: `python -m actors.bench.plain_loop MODULE [ARGUMENTS]`.

Everything in callboard takes uvloop where it can be imported. Here it cannot, so broker and roles run on the
standard library's loop by the same path as on Windows, without an option for it.
"""

from __future__ import annotations

import runpy
import sys


def main() -> None:
    """Hide uvloop and become the module."""
    sys.modules["uvloop"] = None  # type: ignore[assignment]  # what makes `import uvloop` raise ImportError
    del sys.argv[0]
    runpy.run_module(sys.argv[0], run_name="__main__", alter_sys=True)


if __name__ == "__main__":
    main()
