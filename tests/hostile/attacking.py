"""Attack a victim until this process is killed: `python -m tests.hostile.attacking NAME ARGUMENT ...`."""

from __future__ import annotations

import sys
from contextlib import suppress
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from tests.hostile.victims import Attack


def find_attacks() -> dict[str, Attack]:
    """Return the attacks of all modules `*attacks.py`, by name and in the order of their cases."""
    found: dict[str, Attack] = {}
    for path in sorted(Path(__file__).parent.glob("*attacks.py")):
        attacks = import_module(f"tests.hostile.{path.stem}").ATTACKS
        assert not found.keys() & attacks.keys(), f"{path.name} has names of other modules"
        found |= attacks
    return dict(sorted(found.items(), key=lambda item: item[1].case))


def main() -> None:
    """Attack again and again."""
    attack, target = find_attacks()[sys.argv[1]], sys.argv[2:]
    sys.stdout.write("attacking\n")
    sys.stdout.flush()
    while True:
        with suppress(OSError, EOFError):
            attack.run(*target)


if __name__ == "__main__":
    main()
