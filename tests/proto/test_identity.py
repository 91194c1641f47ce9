"""The version is said in one way everywhere."""

from __future__ import annotations

import tomllib
from pathlib import Path

from proto.identity import VERSION, agent, version_of

ROOT = Path(__file__).resolve().parent.parent.parent


def test_the_version_is_the_distributions() -> None:
    """What goes over the wire is what pyproject.toml says."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    assert project["version"] == VERSION


def test_an_agent_names_its_version() -> None:
    """It can be told apart from the implementation; who says none has none."""
    assert agent("callboard-broker") == f"callboard-broker/{VERSION}"
    assert version_of(agent("callboard-broker")) == VERSION
    assert version_of("somebody") == ""
