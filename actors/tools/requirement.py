"""What pip can install, as one writes it in a pyproject.toml (PEP 508): a check of its shape.

    is_requirement("numpy[dev]>=2,<3; python_version > '3.11'")  # True
    is_requirement("x; rm")  # False

A marker is one comparison, or several with "and" and "or" between them; it has no parentheses here.
"""

from __future__ import annotations

import re
from typing import Final

MAX_LENGTH: Final = 1000

_IDENTIFIER: Final = r"[A-Za-z0-9](?:[A-Za-z0-9._-]*[A-Za-z0-9])?"
_VERSION: Final = (
    r"v?(?:\d+!)?\d+(?:\.\d+)*"
    r"(?:[-_.]?(?:alpha|beta|preview|pre|rc|a|b|c)[-_.]?\d*)?"
    r"(?:-\d+|[-_.]?(?:post|rev|r)[-_.]?\d*)?"
    r"(?:[-_.]?dev[-_.]?\d*)?"
)
_LOCAL: Final = r"(?:\+[a-z0-9]+(?:[-_.][a-z0-9]+)*)?"
_SPECIFIER: Final = (
    rf"(?:===\s*[^\s,;()]+|[=!]=\s*(?:v?(?:\d+!)?\d+(?:\.\d+)*\.\*|{_VERSION}{_LOCAL})"
    rf"|(?:[<>]=?)\s*{_VERSION}|~=\s*(?=v?(?:\d+!)?\d+\.\d){_VERSION})"
)
_SPECIFIERS: Final = rf"{_SPECIFIER}(?:\s*,\s*{_SPECIFIER})*"
_URL: Final = r"@\s*[A-Za-z][A-Za-z0-9+.-]*:[^\s\"'\\<>^`{|}]+"
_VARIABLE: Final = (
    r"(?:python_version|python_full_version|os_name|sys_platform|platform_(?:release|system|version|machine"
    r"|python_implementation)|implementation_(?:name|version)|extra)"
)
_TEXT: Final = r"(?:\"[^\"]*\"|'[^']*')"
_OPERATOR: Final = r"(?:\s*(?:===|~=|==|!=|<=|>=|<|>)\s*|\s+in\s+|\s+not\s+in\s+)"
_COMPARISON: Final = rf"(?:{_VARIABLE}{_OPERATOR}{_TEXT}|{_TEXT}{_OPERATOR}{_VARIABLE})"
_MARKER: Final = rf"{_COMPARISON}(?:\s+(?:and|or)\s+{_COMPARISON})*"
_EXTRAS: Final = rf"\[\s*(?:{_IDENTIFIER}(?:\s*,\s*{_IDENTIFIER})*)?\s*\]"
_REQUIREMENT: Final = re.compile(
    rf"{_IDENTIFIER}\s*(?:{_EXTRAS})?\s*"
    rf"(?:(?:{_SPECIFIERS}|\(\s*{_SPECIFIERS}\s*\))?(?:\s*;\s*{_MARKER})?|{_URL}(?:\s+;\s*{_MARKER})?)\s*",
    re.ASCII | re.IGNORECASE,
)


def is_requirement(text: str) -> bool:
    """Tell whether this is a name, with extras, versions or a URL, and a marker if there are any."""
    return len(text) <= MAX_LENGTH and text.isprintable() and _REQUIREMENT.fullmatch(text) is not None
