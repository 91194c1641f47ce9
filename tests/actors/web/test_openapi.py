"""The description of the API fits the routes."""

from __future__ import annotations

import json
import re
from typing import TYPE_CHECKING, Any

import pytest

from actors.web.routes.openapi import ERRORS, openapi
from actors.web.routes.session import NEED_NO_TOKEN
from actors.web.security import SAFE_METHODS
from actors.web.server import PROBES, ROUTES

if TYPE_CHECKING:
    from actors.web.routes.route import Route
    from tests.actors.web.site import Site


@pytest.mark.parametrize("route", ROUTES, ids=lambda route: f"{route.method} {route.path}")
def test_what_changes_something_is_control(route: Route) -> None:
    """Except for signing in, which grants reading only, and signing out."""
    open_to_all = (route.method, route.path) in NEED_NO_TOKEN
    assert route.control is (route.method not in SAFE_METHODS and not open_to_all)
    assert set(route.errors) <= set(ERRORS)


@pytest.mark.parametrize("route", ROUTES, ids=lambda route: f"{route.method} {route.path}")
def test_errors_are_those_that_the_server_can_answer(route: Route) -> None:
    """Probes are answered whoever asks; the others check where a request comes from."""
    assert ({"403", "421"} & set(route.errors)) == (set() if route.path in PROBES else {"403", "421"})


async def test_a_name_that_breaks_the_rules_is_described(site: Site) -> None:
    """A topic that does not exist is no error: it may come."""
    assert "error" in await site.json("/api/topics/1st/echo", 400)
    (echo,) = (each for each in ROUTES if each.path == "/api/topics/{name}/echo")
    assert {"400", "404"} & set(echo.errors) == {"400"}


def test_all_references_lead_somewhere() -> None:
    """A generator of clients resolves them."""
    document = openapi(ROUTES)
    references = set(re.findall(r'"\$ref": "#/components/schemas/(\w+)"', json.dumps(document)))
    assert {"CallBody", "Error", "SignInBody"} <= references <= set(document["components"]["schemas"])


async def test_the_description_is_served_and_linked(site: Site) -> None:
    """Tools find it by the page's link."""
    found: dict[str, Any] = await site.json("/api/openapi.json")
    assert found == json.loads(json.dumps(openapi(ROUTES)))
    async with site.client.get("/") as response:
        assert 'rel="service-desc" href="api/openapi.json"' in await response.text()
