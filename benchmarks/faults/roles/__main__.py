"""`python -m benchmarks.faults.roles '<json parameters>'`: run one role in this process."""

from __future__ import annotations

import asyncio
import json
import sys
from importlib import import_module
from typing import Any

from benchmarks.faults.roles.attempts import counting_loop
from benchmarks.faults.roles.controller import Controller


async def _run(parameters: dict[str, Any]) -> None:
    module: Any = import_module(f"benchmarks.faults.roles.{parameters['role']}")
    await module.run(parameters, Controller())


def main() -> None:
    """Run a role to its end."""
    with asyncio.Runner(loop_factory=counting_loop) as runner:
        runner.run(_run(json.loads(sys.argv[1])))


if __name__ == "__main__":
    main()
