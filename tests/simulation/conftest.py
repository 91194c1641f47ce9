"""`--seeds N` runs N histories of each kind instead of a few; `--first-seed S` starts at S, to replay one."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import pytest

DEFAULT_SEEDS = 15


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add the options."""
    group = parser.getgroup("simulation")
    group.addoption("--seeds", type=int, default=DEFAULT_SEEDS, help="simulated histories of each kind")
    group.addoption("--first-seed", type=int, default=0, help="the first history's seed")


def pytest_generate_tests(metafunc: pytest.Metafunc) -> None:
    """Give a test that takes `history_seed` one run for each seed."""
    if "history_seed" in metafunc.fixturenames:
        # Run from the root without naming this folder, pytest reads this file too late for its options.
        first = metafunc.config.getoption("--first-seed", 0)
        count = metafunc.config.getoption("--seeds", DEFAULT_SEEDS)
        metafunc.parametrize("history_seed", range(first, first + count))
