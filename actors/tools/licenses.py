"""Licences: their SPDX identifiers, and the texts of those that most packages have."""

from __future__ import annotations

import re
from importlib.resources import files
from string import Template
from typing import Final

WITH_TEXT: Final = ("Apache-2.0", "BSD-3-Clause", "MIT")
"""Those whose text is here."""


def spdx(name: str) -> str:
    """Return the SPDX identifier for a licence, as `license` in pyproject.toml has to have one.

    Args:
        name: An identifier, in whatever case, or an expression such as "MIT OR Apache-2.0". Anything else is
            a licence of one's own: "LicenseRef-…".
    """
    from packaging.licenses import (  # noqa: PLC0415 - seldom needed
        InvalidLicenseExpression,
        canonicalize_license_expression,
    )

    try:
        return canonicalize_license_expression(name)
    except InvalidLicenseExpression:
        own = re.sub(r"[^A-Za-z0-9.-]+", "-", name.removeprefix("LicenseRef-")).strip("-")
        return f"LicenseRef-{own or 'Unknown'}"


def license_text(name: str, *, holder: str, year: int) -> str | None:
    """Return the text of a licence for a LICENSE file; None if it is not here.

    Args:
        name: Its SPDX identifier, in whatever case.
        holder: Who has the copyright.
        year: Since when.
    """
    identifier = spdx(name)
    if identifier not in WITH_TEXT:
        return None
    template = files("actors.tools") / "templates" / "licenses" / f"{identifier}.txt"
    return Template(template.read_text(encoding="utf-8")).substitute(holder=holder, year=year)
