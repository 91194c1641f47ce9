"""Find the tests of each numbered attack (README.md): print them with `python -m tests.hostile.numbers`."""

from __future__ import annotations

import ast
import json
import re
import sys
from collections import defaultdict
from pathlib import Path
from typing import Final

TESTS: Final = Path(__file__).resolve().parent.parent
HIGHEST: Final = 95

_CASES: Final = re.compile(r"\b[Cc]ases? (\d+(?:(?:, | and | to |, and )\d+)*)")


def numbers_in(text: str) -> set[int]:
    """Return the numbers that a docstring names: "Case 5", "cases 4, 6, 10 to 15 and 17"."""
    found: set[int] = set()
    for group in _CASES.findall(text):
        for first, last in re.findall(r"(\d+)(?: to (\d+))?", group):
            found.update(range(int(first), int(last or first) + 1))
    return found


def find_tests() -> dict[int, list[str]]:
    """Return the tests of each number, as `file::test`; byte-level cases as `file: name`."""
    tests: dict[int, list[str]] = defaultdict(list)
    for path in sorted(TESTS.rglob("test_*.py")):
        text = path.read_text(encoding="utf-8")
        body = ast.parse(text).body if _CASES.search(text) else []
        for node in [*body, *(each for cls in body for each in getattr(cls, "body", ()))]:
            if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef) and node.name.startswith("test_"):
                for number in numbers_in(ast.get_docstring(node) or ""):
                    tests[number].append(f"{path.relative_to(TESTS.parent)}::{node.name}")
    for path in sorted((TESTS / "hostile" / "bytes").glob("*.json")):
        for case in json.loads(path.read_text(encoding="utf-8"))["cases"]:
            for number in case["cases"]:
                tests[number].append(f"{path.relative_to(TESTS.parent)}: {case['name']}")
    return tests


if __name__ == "__main__":
    tests = find_tests()
    for each in range(1, HIGHEST + 1):
        sys.stdout.write("".join(f"{each:2}  {test}\n" for test in tests[each]) or f"{each:2}  none\n")
