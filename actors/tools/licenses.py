"""Licences: their SPDX identifiers, and the texts of those that most packages have."""

from __future__ import annotations

import re
from importlib.resources import files
from string import Template
from typing import Final

WITH_TEXT: Final = ("Apache-2.0", "BSD-3-Clause", "MIT")
"""Those whose text is here."""

_KNOWN: Final = {
    each.lower(): each
    for each in (
        *WITH_TEXT,
        "0BSD",
        "AGPL-3.0-only",
        "AGPL-3.0-or-later",
        "BSD-2-Clause",
        "BSL-1.0",
        "CC0-1.0",
        "EPL-2.0",
        "EUPL-1.2",
        "GPL-2.0-only",
        "GPL-2.0-or-later",
        "GPL-3.0-only",
        "GPL-3.0-or-later",
        "ISC",
        "LGPL-2.1-only",
        "LGPL-2.1-or-later",
        "LGPL-3.0-only",
        "LGPL-3.0-or-later",
        "MIT-0",
        "MPL-2.0",
        "Unlicense",
        "Zlib",
    )
}


def spdx(name: str) -> str:
    """Return the SPDX identifier for a licence, as `license` in pyproject.toml has to have one.

    Args:
        name: An identifier, in whatever case. Anything else is a licence of one's own: "LicenseRef-…".
    """
    own = re.sub(r"[^A-Za-z0-9.-]+", "-", name.removeprefix("LicenseRef-")).strip("-")
    return _KNOWN.get(name.lower(), f"LicenseRef-{own or 'Unknown'}")


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
