"""Licences: identifiers and texts."""

from __future__ import annotations

import pytest

from actors.tools.licenses import WITH_TEXT, license_text, spdx


@pytest.mark.parametrize(
    ("name", "identifier"),
    [
        ("Apache-2.0", "Apache-2.0"),
        ("mit", "MIT"),
        ("gpl-3.0-ONLY", "GPL-3.0-only"),
        ("mit or apache-2.0", "MIT OR Apache-2.0"),
        ("Proprietary", "LicenseRef-Proprietary"),
        ("Our own, all rights reserved!", "LicenseRef-Our-own-all-rights-reserved"),
        ("LicenseRef-House_Rules", "LicenseRef-House-Rules"),
        ("???", "LicenseRef-Unknown"),
    ],
)
def test_every_name_becomes_an_identifier(name: str, identifier: str) -> None:
    """Those that SPDX knows as they are, others as references that pyproject.toml may have."""
    assert spdx(name) == identifier


@pytest.mark.parametrize("name", WITH_TEXT)
def test_texts_are_complete(name: str) -> None:
    """Nothing is left to fill in, and they end as licences do."""
    text = license_text(name.lower(), holder="Ada", year=1843)
    assert text is not None
    assert "$" not in text
    assert text.endswith(".\n")
    assert ("Copyright (c) 1843 Ada\n" in text) is (name != "Apache-2.0")


def test_an_unknown_text_is_none() -> None:
    """The identifier may be known all the same."""
    assert license_text("GPL-3.0-only", holder="Ada", year=1843) is None
