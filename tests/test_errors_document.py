"""docs/reference/errors.md has every public error, all named by one rule."""

from __future__ import annotations

import importlib
import inspect
import re
from pathlib import Path
from pkgutil import resolve_name
from typing import Final

import pytest

import actors
import callboard

PACKAGES: Final = (
    "callboard",
    "actors.bags",
    "actors.interfaces",
    "actors.launch",
    "actors.testing",
    "actors.threads",
)
DOCUMENT: Final = (Path(__file__).parents[1] / "docs/reference/errors.md").read_text(encoding="utf-8")
SECTIONS: Final = dict(re.findall(r"^## (.+)\n([^#]+)", DOCUMENT, re.MULTILINE))
RENAMED: Final = dict(re.findall(r"^\| `([\w.]+)` \| `([\w.]+)` \|$", SECTIONS["Former names"], re.MULTILINE))


def errors() -> dict[str, type[BaseException]]:
    """Return the public errors."""
    found = {
        name: getattr(module, name)
        for module in map(importlib.import_module, PACKAGES)
        for name in module.__all__
    }
    return {
        name: value
        for name, value in found.items()
        if inspect.isclass(value) and issubclass(value, BaseException)
    }


def listed(section: str) -> list[str]:
    """Return the errors that a section lists: those of the first column, before a remark in brackets."""
    cells = re.findall(r"^\| (`[^|]+) \|", SECTIONS[section], re.MULTILINE)
    return [name for cell in cells for name in re.findall(r"`(\w+)`", cell.partition(" (")[0])]


def test_the_document_has_every_error() -> None:
    """Once, and no other."""
    sections = ("Conditions of the running system", "Mistakes", "Exceptions to the rule")
    assert sorted(name for each in sections for name in listed(each)) == sorted(errors())


def test_the_names_follow_the_rule() -> None:
    """Mistakes end in Error, conditions do not; the exceptions are conditions that do."""
    assert not [name for name in listed("Conditions of the running system") if name.endswith("Error")]
    assert not [name for name in listed("Mistakes") if not name.endswith("Error")]
    assert all(name.endswith("Error") for name in listed("Exceptions to the rule"))


def test_the_document_names_the_bases() -> None:
    """All errors are CallboardErrors, and those of the column "also a"."""
    rows = re.findall(
        r"^\| `(\w+)`[^|]* \|([^|]*)\|", SECTIONS["Conditions of the running system"], re.MULTILINE
    )
    for name, bases in rows:
        for base in re.findall(r"`(\w+)`", bases):
            assert issubclass(errors()[name], errors().get(base) or resolve_name(f"builtins:{base}"))
    assert all(issubclass(each, callboard.CallboardError) for each in errors().values())


@pytest.mark.parametrize("former", RENAMED)
def test_a_former_name_warns_and_is_the_same_class(former: str) -> None:
    """The warning gives the present name, each time, and editors do not offer the former one."""
    package, _, name = former.rpartition(".")
    module = importlib.import_module(package)
    for _ in range(2):
        with pytest.warns(DeprecationWarning, match=f"{former} is called {RENAMED[former]}$") as caught:
            value = getattr(module, name)
        assert caught[0].filename == __file__
        assert value is resolve_name(RENAMED[former].replace(f"{package}.", f"{package}:"))
    assert name not in dir(module)
    assert name not in module.__all__


def test_a_former_name_can_be_imported_from_its_package() -> None:
    """As programs do."""
    with pytest.warns(DeprecationWarning, match="actors.NodeAlreadyRunning is called"):
        from actors import NodeAlreadyRunning  # type: ignore[attr-defined]  # noqa: PLC0415
    assert NodeAlreadyRunning is actors.NodeAlreadyRunningError
