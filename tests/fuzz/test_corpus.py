"""Replay the fuzzers' corpus: inputs that reach different parts of the code, and those that once failed."""

from __future__ import annotations

from importlib import import_module
from pathlib import Path

import pytest

CORPUS = Path(__file__).parent / "corpus"
TARGETS = ("codec", "session", "router", "rules", "mesh", "launch", "parameters", "web")


@pytest.mark.parametrize("target", TARGETS)
def test_no_input_of_the_corpus_fails(target: str) -> None:
    """Each input keeps what its target checks."""
    inputs = sorted((CORPUS / target).iterdir())
    assert inputs
    module = import_module(f"tests.fuzz.{target}")
    try:
        for file in inputs:
            try:
                module.check(file.read_bytes())
            except Exception as error:
                error.add_note(f"input: {file}")
                raise
    finally:
        if hasattr(module, "close"):
            module.close()
