"""The description of the API fits the routes."""

from __future__ import annotations

import json
import re
from typing import TYPE_CHECKING, Any

import pytest

from actors.web.openapi import ERRORS, OPERATIONS, Operation, openapi
from actors.web.routes.session import NEED_NO_TOKEN
from actors.web.security import SAFE_METHODS
from actors.web.server import PROBES, ROUTE_MODULES

if TYPE_CHECKING:
    from tests.actors.web.site import Site


def test_every_route_is_described_and_every_description_is_a_route() -> None:
    """With its method; patterns of names are left out."""
    routes = {
        (each.method, re.sub(r":[^{}]+\}", "}", each.path))
        for module in ROUTE_MODULES
        for each in module.ROUTES
    }
    assert set(OPERATIONS) == routes


@pytest.mark.parametrize(("key", "operation"), OPERATIONS.items(), ids=map(" ".join, OPERATIONS))
def test_what_changes_something_is_control(key: tuple[str, str], operation: Operation) -> None:
    """Except for signing in, which grants reading only, and signing out."""
    assert operation.control is (key[0] not in SAFE_METHODS and key not in NEED_NO_TOKEN)
    assert set(operation.errors) <= set(ERRORS)


@pytest.mark.parametrize(("key", "operation"), OPERATIONS.items(), ids=map(" ".join, OPERATIONS))
def test_errors_are_those_that_the_server_can_answer(key: tuple[str, str], operation: Operation) -> None:
    """Probes are answered whoever asks; the others check where a request comes from."""
    assert ({"403", "421"} & set(operation.errors)) == (set() if key[1] in PROBES else {"403", "421"})


async def test_a_name_that_breaks_the_rules_is_described(site: Site) -> None:
    """A topic that does not exist is no error: it may come."""
    assert "error" in await site.json("/api/topics/1st/echo", 400)
    assert {"400", "404"} & set(OPERATIONS["GET", "/api/topics/{name}/echo"].errors) == {"400"}


def test_all_references_lead_somewhere() -> None:
    """A generator of clients resolves them."""
    document = openapi()
    references = set(re.findall(r'"\$ref": "#/components/schemas/(\w+)"', json.dumps(document)))
    assert {"CallBody", "Error", "SignInBody"} <= references <= set(document["components"]["schemas"])


async def test_the_description_is_served_and_linked(site: Site) -> None:
    """Tools find it by the page's link."""
    found: dict[str, Any] = await site.json("/api/openapi.json")
    assert found == json.loads(json.dumps(openapi()))
    async with site.client.get("/") as response:
        assert 'rel="service-desc" href="api/openapi.json"' in await response.text()
