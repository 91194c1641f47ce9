"""Licences: SPDX identifiers, and the texts of the most common ones."""

from __future__ import annotations

import re
from importlib.resources import files
from string import Template
from typing import Final

WITH_TEXT: Final = ("Apache-2.0", "BSD-3-Clause", "MIT")
"""Licences whose text is included."""


def spdx(name: str) -> str:
    """Return the SPDX identifier of a licence, as `license` in pyproject.toml needs it.

    Args:
        name: An identifier, in any case, or an expression such as "MIT OR Apache-2.0". Any other text
            becomes a custom identifier: "LicenseRef-…".
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
    """Return the text of a licence for a LICENSE file; None if it is not included.

    Args:
        name: Its SPDX identifier, in any case.
        holder: The copyright holder.
        year: The first year of the copyright.
    """
    identifier = spdx(name)
    if identifier not in WITH_TEXT:
        return None
    template = files("actors.tools") / "templates" / "licenses" / f"{identifier}.txt"
    return Template(template.read_text(encoding="utf-8")).substitute(holder=holder, year=year)
