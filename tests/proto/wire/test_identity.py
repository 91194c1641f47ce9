"""The version is the same everywhere."""

from __future__ import annotations

import tomllib
from pathlib import Path

from proto.wire.identity import VERSION, agent, version_of

ROOT = Path(__file__).resolve().parent.parent.parent.parent


def test_the_version_is_the_distributions() -> None:
    """The version on the wire is that of pyproject.toml."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    assert project["version"] == VERSION


def test_an_agent_names_its_version() -> None:
    """It can be split from the implementation's name; without one it is empty."""
    assert agent("callboard-broker") == f"callboard-broker/{VERSION}"
    assert version_of(agent("callboard-broker")) == VERSION
    assert version_of("somebody") == ""
