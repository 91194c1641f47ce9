"""The import contracts in pyproject.toml also hold through modules that they do not name."""

from __future__ import annotations

import ast
import re
import tomllib
from copy import deepcopy
from pathlib import Path

import grimp
import pytest
from importlinter import configuration
from importlinter.contracts.forbidden import ForbiddenContract

ROOT = Path(__file__).resolve().parent.parent
OPTIONS = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["importlinter"]
PACKAGES = OPTIONS["root_packages"]


@pytest.fixture(scope="module")
def imports() -> grimp.ImportGraph:
    """Return all imports of the product, including those for type checking."""
    configuration.configure()
    return grimp.build_graph(*PACKAGES, include_external_packages=True, cache_dir=None)


def test_each_package_says_what_it_may_import(imports: grimp.ImportGraph) -> None:
    """Except generated ones, groups of commands, and those that have the names of ROS 2's packages."""
    others = ("actors", "actors.interfaces.", "actors.cli.", "actors.ros.")
    for name in sorted(imports.modules):
        if name.startswith(others[1:]) or name == others[0]:
            continue
        if name.split(".")[0] in PACKAGES and imports.find_children(name):
            source = ROOT.joinpath(*name.split("."), "__init__.py").read_text(encoding="utf-8")
            says = ast.get_docstring(ast.parse(source)) or ""
            assert re.search(r"\b[Ii]mports?\b", says), name


def is_pure(imports: grimp.ImportGraph) -> bool:
    """Check the contract of the pure packages."""
    (options,) = (each for each in OPTIONS["contracts"] if each["name"].startswith("protocol and routing"))
    texts = {name: str(value) if isinstance(value, bool) else value for name, value in options.items()}
    contract = ForbiddenContract(options["name"], OPTIONS, texts)
    return contract.check(deepcopy(imports), verbose=False).kept


def test_nothing_that_the_router_imports_may_import_asyncio(imports: grimp.ImportGraph) -> None:
    """One `import asyncio` in any module that the router reaches breaks the contract."""
    assert is_pure(imports)
    reached = {
        name
        for name in imports.find_upstream_modules("broker.routing.router")
        if name.split(".")[0] in PACKAGES
    }
    assert len(reached) > 20
    for name in reached:
        broken = deepcopy(imports)
        broken.add_import(importer=name, imported="asyncio")
        assert not is_pure(broken), f"{name} may import asyncio"
