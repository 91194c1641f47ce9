"""The command that installs what an optional part of callboard needs.

It names the packages themselves, which works wherever callboard came from: a clone, a wheel, an index.
"""

from __future__ import annotations

import re


def install_command(extra: str, *names: str) -> str:
    """Return the command that installs the packages of an extra.

    Args:
        extra: One of callboard's extras, such as "web".
        *names: The packages to name; by default all of the extra.

    Returns:
        The command, and the name of the extra in parentheses. If callboard is not installed, the packages are
        not known, and the command installs the extra from a clone.
    """
    from importlib import metadata  # noqa: PLC0415 - only when something is missing

    try:
        requirements = metadata.requires("callboard") or ()
    except metadata.PackageNotFoundError:  # it runs from a folder, without being installed
        requirements = ()
    # As setuptools writes them: aiohttp>=3.14; extra == "web"
    found = [line.partition(";")[0].strip() for line in requirements if f'extra == "{extra}"' in line]
    wanted = [each for each in found if not names or re.split(r"[^\w.-]", each)[0] in names]
    if not wanted:
        return f"pip install '.[{extra}]' in a clone of callboard"
    quoted = " ".join(f"'{each}'" for each in wanted)
    return f"pip install {quoted} (callboard's extra '{extra}')"
