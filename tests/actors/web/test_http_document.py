"""docs/reference/http.md against the routes."""

from __future__ import annotations

import re
from pathlib import Path

from actors.web.server import ROUTES

DOCUMENT = (Path(__file__).parents[3] / "docs" / "reference" / "http.md").read_text(encoding="utf-8")


def test_every_route_is_documented_and_nothing_else() -> None:
    """Names and ids are placeholders; queries are left out."""
    routes = {
        (
            route.method,
            re.sub(r"\{goal[^}]*\}+", "ID", re.sub(r"\{name:[^}]*\}", "NAME", route.pattern)).rstrip("}"),
        )
        for route in ROUTES
    }
    documented = set(re.findall(r"`(GET|POST|PATCH|DELETE) ([^`?]*)(?:\?[^`]*)?`", DOCUMENT))
    assert documented == routes
