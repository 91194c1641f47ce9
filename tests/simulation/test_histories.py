"""Histories of random worlds: the real broker and the real nodes keep their promises in each."""

from __future__ import annotations

import logging
from typing import Any

import pytest

from tests.simulation.histories import live


@pytest.mark.parametrize("calm", [True, False], ids=["calm", "troubled"])
def test_a_history_keeps_every_promise(history_seed: int, *, calm: bool) -> None:
    """Calm ones lose nothing with KEEP_ALL; troubled ones count every loss; no history hangs."""
    history = live(history_seed, calm=calm)
    assert not history.wrong, history.wrong


@pytest.mark.long
def test_the_same_seed_gives_the_same_history() -> None:
    """A history is reproducible, in any checkout: every byte travels at the same time."""
    history = live(2, calm=False)  # short, with ten faults
    make = logging.getLogRecordFactory()

    def make_elsewhere(*arguments: Any, **options: Any) -> logging.LogRecord:
        record = make(*arguments, **options)
        record.pathname = f"/a/much/longer/path{record.pathname}"
        return record

    logging.setLogRecordFactory(make_elsewhere)
    try:
        assert live(2, calm=False) == history
    finally:
        logging.setLogRecordFactory(make)
