"""A folder of installed packages, made of metadata alone."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path


class Site:
    """The site-packages folder of an environment."""

    def __init__(self, prefix: Path) -> None:
        self.prefix = prefix
        self.path = prefix / "lib" / "python3.11" / "site-packages"
        self.path.mkdir(parents=True)

    def install(
        self,
        name: str,
        *,
        version: str = "1.0",
        requires: Sequence[str] = (),
        scripts: Sequence[str] = (),
        files: Sequence[str] = (),
    ) -> Path:
        """Write the metadata of a package; return its folder."""
        info = self.path / f"{name.replace('-', '_')}-{version}.dist-info"
        info.mkdir()
        required = "".join(f"Requires-Dist: {each}\n" for each in requires)
        (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: {version}\n{required}")
        (info / "entry_points.txt").write_text("\n".join(["[console_scripts]", *scripts]))
        (info / "RECORD").write_text("".join(f"{each},,\n" for each in files))
        return info
