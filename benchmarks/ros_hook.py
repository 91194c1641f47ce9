"""What packaging/callboard-ros adds to the start of a process that uses none of it.

    python benchmarks/ros_hook.py

Each round is a process of its own, which reads a folder with the `.pth` file as Python does at its start, and
then an empty one; the difference counts. After that come the imports that the hook compares names for.
"""

from __future__ import annotations

import argparse
import json
import shutil
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Final

HOOK: Final = Path(__file__).resolve().parents[1] / "packaging" / "callboard-ros"
LIMIT_MS: Final = 0.5
IMPORTS: Final = 300
"""Of a process that imports as much as a large program."""
ROUND: Final = f"""
import json, site, sys, time
first, *folders = sys.argv[1:]
site.addsitedir(first)  # what is slow only once
times = []
for folder in folders:
    began = time.perf_counter()
    site.addsitedir(folder)
    times.append(time.perf_counter() - began)
hook = sys.meta_path[0]
began = time.perf_counter()
for _ in range({IMPORTS}):
    hook.find_spec("a_module", None)
print(json.dumps([times[0] - times[1], time.perf_counter() - began]))
"""


def measure(rounds: int, folder: Path) -> tuple[float, float]:
    """Return the medians of both times, in milliseconds."""
    hook, *empty = (folder / name for name in ("hook", "first", "empty"))
    hook.mkdir()
    for each in empty:
        each.mkdir()
        (each / "none.pth").touch()
    for name in ("callboard_ros.pth", "callboard_ros_hook.py"):
        shutil.copy(HOOK / name, hook)
    command = [sys.executable, "-I", "-S", "-c", ROUND, str(empty[0]), str(hook), str(empty[1])]
    done = [subprocess.run(command, check=True, capture_output=True).stdout for _ in range(rounds + 1)]
    starts, imports = zip(*map(json.loads, done[1:]), strict=True)  # the first one compiles
    return 1000 * statistics.median(starts), 1000 * statistics.median(imports)


def main() -> None:
    """Print the times, and fail beyond the limit."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rounds", type=int, default=100)
    with tempfile.TemporaryDirectory() as folder:
        start, imports = measure(parser.parse_args().rounds, Path(folder))
    print(f"start {start:.3f} ms, {IMPORTS} imports {imports:.3f} ms (limit {LIMIT_MS} ms together)")
    raise SystemExit(start + imports > LIMIT_MS)


if __name__ == "__main__":
    main()
