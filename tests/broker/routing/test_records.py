"""A peer's record has one owner for each field."""

from __future__ import annotations

import ast
import re
from dataclasses import fields
from pathlib import Path

from broker.routing.records import Peer

ROUTING = Path(__file__).parents[3] / "broker" / "routing"


def owners() -> dict[str, str]:
    """Return the module that the comment above each field names."""
    source = (ROUTING / "records.py").read_text(encoding="utf-8")
    body = source[source.index("class Peer:") : source.index("    def rights(")]
    found: dict[str, str] = {}
    owner = ""
    for line in body.splitlines():
        if comment := re.match(r"    # (\w+)", line):
            owner = comment[1]
        elif name := re.match(r"    (\w+): ", line):
            found[name[1]] = owner
    return found


def changed_fields(source: str) -> set[str]:
    """Return the attributes of something called `peer` that a module assigns."""
    found: set[str] = set()
    for node in ast.walk(ast.parse(source)):
        targets = node.targets if isinstance(node, ast.Assign) else [getattr(node, "target", None)]
        for target in targets:
            for part in target.elts if isinstance(target, ast.Tuple) else [target]:
                if isinstance(part, ast.Attribute) and ast.unparse(part.value).split(".")[-1] == "peer":
                    found.add(part.attr)
    return found


def test_the_comment_names_who_changes_a_field() -> None:
    """Each field of `Peer` has an owner, and no other module of the broker assigns it."""
    owned_by = owners()
    assert owned_by.keys() == {each.name for each in fields(Peer)}
    assert all((ROUTING / f"{owner}.py").exists() for owner in owned_by.values())
    for path in ROUTING.parent.rglob("*.py"):
        for name in changed_fields(path.read_text(encoding="utf-8")) & owned_by.keys():
            assert (owned_by[name], path.parent) == (path.stem, ROUTING), f"{path.name} changes {name}"


def test_a_change_is_noticed() -> None:
    """Assignments of all forms count."""
    source = "peer.a = 1\nclient.peer.b += 1\npeer.c, peer.d = 1, 2\npeer.e: int = 1\nother.f = peer.g"
    assert changed_fields(source) == set("abcde")
