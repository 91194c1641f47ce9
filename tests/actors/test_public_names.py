"""Tests of the package roots: what they promise is there, and loads lazily."""

from __future__ import annotations

import ast
import subprocess
import sys
from pathlib import Path

import pytest

import actors
import actors.launch
import actors.testing
import actors.threads
import broker


@pytest.mark.parametrize("package", [actors, actors.launch, actors.testing, actors.threads, broker])
def test_every_promised_name_exists(package: object) -> None:
    """Each name that type checkers see can be had at run time, from the module that checkers see it in."""
    source = Path(str(package.__file__)).read_text(encoding="utf-8")  # type: ignore[attr-defined]
    promised = [
        (node.module, alias.name)
        for node in ast.walk(ast.parse(source))
        if isinstance(node, ast.ImportFrom)
        for alias in node.names
        if alias.asname == alias.name
    ]
    assert promised
    for module, name in promised:
        assert name in dir(package)
        assert getattr(package, name) is getattr(sys.modules[str(module)], name)


def test_an_unknown_name_is_an_attribute_error() -> None:
    """A typo gets Python's usual answer."""
    with pytest.raises(AttributeError, match="has no attribute 'Nod'"):
        actors.Nod  # noqa: B018


def test_importing_actors_loads_no_part_of_it() -> None:
    """`import actors` alone is cheap: no module of the package is loaded but what loads the others."""
    code = "import sys, actors; print([m for m in sys.modules if m[:7] in ('actors.', 'msgspec')])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "['actors.lazy']"
