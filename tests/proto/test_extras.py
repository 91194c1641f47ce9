"""What to install for an optional part of callboard."""

from __future__ import annotations

import re
import shlex
import tomllib
from importlib import metadata
from pathlib import Path
from typing import NoReturn

import pytest

from proto.extras import install_command

ROOT = Path(__file__).resolve().parent.parent.parent
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]


@pytest.mark.parametrize("extra", ["numpy", "testing", "top", "watch", "web", "zenoh"])
def test_the_command_names_the_packages_of_the_extra(extra: str) -> None:
    """From any index, wherever callboard itself came from; and it names the extra."""
    command, _, note = install_command(extra).partition(" (")
    assert shlex.split(command) == ["pip", "install", *PROJECT["optional-dependencies"][extra]]
    assert note == f"callboard's extra '{extra}')"


def test_only_some_packages_of_a_large_extra() -> None:
    """Those whose names begin alike are not meant."""
    assert install_command("testing", "pytest") == "pip install 'pytest>=8.3' (callboard's extra 'testing')"


def test_a_clone_that_is_not_installed_names_itself(monkeypatch: pytest.MonkeyPatch) -> None:
    """There are no metadata to read the packages from."""

    def missing(_: str) -> NoReturn:
        raise metadata.PackageNotFoundError

    monkeypatch.setattr(metadata, "requires", missing)
    assert install_command("web") == "pip install '.[web]' in a clone of callboard"


def test_no_text_installs_an_extra_of_callboard_from_an_index() -> None:
    """`pip install callboard[web]` fails while callboard is on no index."""
    folders = ("actors", "broker", "callboard", "docs", "examples", "packaging", "proto")
    files = [file for folder in folders for file in (ROOT / folder).rglob("*.[pm][yd]")]
    for file in (ROOT / "README.md", *files):
        found = re.findall(r"pip install '?\"?callboard.*", file.read_text(encoding="utf-8"))
        assert not found, (file, found)
