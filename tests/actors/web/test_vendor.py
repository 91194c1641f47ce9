"""The page's libraries are those that their table names."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Final

import pytest

from actors import web

VENDOR: Final = Path(web.__file__).parent / "assets" / "vendor"
PACKAGES: Final = Path(__file__).parents[2] / "browser" / "package.json"
MIT: Final = "Permission is hereby granted, free of charge, to any person obtaining a copy"


def rows() -> list[tuple[str, str, str, list[str]]]:
    """Return the table: library, version, licence and files."""
    text = (VENDOR / "README.md").read_text(encoding="utf-8")
    found = re.findall(r"^\| \[(.+?)\]\(.+?\) \| (\S+) \| (\S+) \| (.+?) \|", text, re.MULTILINE)
    return [
        (name, version, licence, re.findall(r"`(.+?)`", files)) for name, version, licence, files in found
    ]


def test_the_table_names_exactly_the_files_that_exist() -> None:
    """No library comes in without its licence and version."""
    named = [file for *_, files in rows() for file in files]
    assert sorted([*named, "README.md"]) == sorted(path.name for path in VENDOR.iterdir())


@pytest.mark.parametrize(("name", "version", "licence", "files"), rows())
def test_a_library_has_its_version_and_licence(
    name: str, version: str, licence: str, files: list[str]
) -> None:
    """The version stands inside its code, and is the one whose types `make web-test` checks against."""
    texts = {file: (VENDOR / file).read_text(encoding="utf-8") for file in files}
    code = "".join(text for file, text in texts.items() if file.endswith("js"))
    assert re.search(rf"[\"v]{re.escape(version)}[\")]", code)
    (licence_file,) = [file for file in files if file.endswith(".LICENSE.txt")]
    assert licence == "MIT"
    assert MIT in " ".join(texts[licence_file].split())
    packages = json.loads(PACKAGES.read_text(encoding="utf-8"))["devDependencies"]
    (package,) = [each for each in packages if each.rpartition("/")[2] in name.lower()]
    assert packages[package] == version
