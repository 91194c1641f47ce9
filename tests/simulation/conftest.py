"""`--seeds N` runs N histories of each kind instead of a few; `--first-seed S` starts at S, to replay one."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import pytest

DEFAULT_SEEDS = {"history_seed": range(5), "mesh_seed": range(1, 3)}
"""By the name of a test's argument, the seeds of the histories of each kind."""

NIGHTLY_SEEDS = {"history_seed": range(15), "mesh_seed": range(1, 16)}
"""Those of `make nightly`."""


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add the options."""
    group = parser.getgroup("simulation")
    group.addoption("--seeds", type=int, help="simulated histories of each kind")
    group.addoption("--first-seed", type=int, help="the first history's seed")


def pytest_generate_tests(metafunc: pytest.Metafunc) -> None:
    """Give a test that takes a seed one run for each seed."""
    nightly = metafunc.config.getoption("--nightly")
    for name, few in (NIGHTLY_SEEDS if nightly else DEFAULT_SEEDS).items():
        if name in metafunc.fixturenames:
            # Run from the root without naming this folder, pytest reads this file too late for its options.
            first = metafunc.config.getoption("--first-seed", None)
            first = few.start if first is None else first
            count = metafunc.config.getoption("--seeds", None) or len(few)
            metafunc.parametrize(name, range(first, first + count))
