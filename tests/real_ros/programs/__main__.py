"""Answer questions: each line of stdin is a function of a module beside this one with its arguments, as JSON.

The modules of another package are asked if its name is the argument.

What the programs print, and ROS 2's libraries in C, goes to stderr: stdout has the answers only.
"""

from __future__ import annotations

import json
import os
import sys
import traceback
from importlib import import_module

from tests.real_ros.programs.errors import error_names


def answer(package: str, function: str, args: list[object]) -> dict[str, object]:
    """Return what a function returns or raises."""
    module, _, name = function.partition(".")
    try:
        return {"returned": getattr(import_module(f"{package}.{module}"), name)(*args)}
    except Exception as error:  # noqa: BLE001 - whatever a program raises is its answer
        raised = {"raised": error_names(error), "text": str(error)}
        return {**raised, "traceback": "".join(traceback.format_exception(error))}


def main() -> None:
    """Answer until the input ends."""
    package = sys.argv[1] if sys.argv[1:] else "tests.real_ros.programs"
    answers = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)
    for line in sys.stdin:
        answers.write(json.dumps(answer(package, *json.loads(line)), default=repr) + "\n")
        answers.flush()


main()
