"""Bytecode for test runs that PYTHONDONTWRITEBYTECODE forbids to write any beside the sources."""

from __future__ import annotations

import atexit
import os
import shutil
import sys
import tempfile
from pathlib import Path


def cache_bytecode() -> None:
    """Keep bytecode in a folder for this process, its workers and the programs that tests start.

    PYTHONDONTWRITEBYTECODE wants no files beside the sources, but without bytecode each start of a program
    compiles callboard again, which takes longer than all else that the program does.
    """
    cache = Path(__file__).parents[1] / ".pytest_cache" / "bytecode"
    os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
    os.environ["PYTHONPYCACHEPREFIX"] = sys.pycache_prefix = str(cache)
    sys.dont_write_bytecode = False
    temporary = Path(tempfile.gettempdir()).resolve()
    if temporary not in cache.resolve().parents:  # a checkout there keeps its own
        atexit.register(shutil.rmtree, cache / temporary.relative_to(temporary.anchor), ignore_errors=True)
