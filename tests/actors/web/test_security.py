"""Who may ask for what."""

from __future__ import annotations

import pytest

from actors.web.security import AccessPolicy, bearer, new_token

POLICY = AccessPolicy(token="secret", control=True)
HOST = {"Host": "127.0.0.1:7412"}


@pytest.mark.parametrize(
    "host",
    ["127.0.0.1:7412", "localhost:7412", "localhost", "[::1]:7412", "ROBOT:7412", "192.168.7.5:7412"],
)
def test_the_server_goes_by_addresses_and_by_the_names_that_it_was_given(host: str) -> None:
    """With any port, as it may be forwarded; no page can make an address lead to another machine."""
    assert AccessPolicy(token="t", hosts=frozenset({"robot"})).refuses_origin({"Host": host}) is None


@pytest.mark.parametrize(
    "host",
    ["", "evil.example", "evil.example:7412", "localhost.evil.example", "127.0.0.1.nip.io", "[", "a@b:c"],
)
def test_another_host_is_refused(host: str) -> None:
    """A name that leads to this server by DNS rebinding."""
    refusal = POLICY.refuses_origin({"Host": host})
    assert refusal is not None
    assert refusal.status == 421


@pytest.mark.parametrize(
    "headers",
    [
        {"Origin": "http://evil.example"},
        {"Origin": "null"},
        {"Origin": "http://["},
        {"Origin": "http://127.0.0.1:8000"},
        {"Sec-Fetch-Site": "cross-site"},
        {"Sec-Fetch-Site": "same-site"},
        {"Sec-Fetch-Site": "cross-site", "Sec-Fetch-Mode": "navigate", "Sec-Fetch-Dest": "iframe"},
        {"Sec-Fetch-Site": "cross-site", "Sec-Fetch-Dest": "document", "Origin": "http://evil.example"},
    ],
)
def test_a_page_of_another_site_is_refused(headers: dict[str, str]) -> None:
    """Another port is another site, too."""
    refusal = POLICY.refuses_origin({**HOST, **headers})
    assert refusal is not None
    assert refusal.status == 403


@pytest.mark.parametrize(
    "headers",
    [
        {},
        {"Origin": "http://127.0.0.1:7412"},
        {"Sec-Fetch-Site": "same-origin"},
        {"Sec-Fetch-Site": "none"},
        {"Sec-Fetch-Site": "cross-site", "Sec-Fetch-Dest": "document"},
    ],
)
def test_its_own_page_and_programs_are_not_refused(headers: dict[str, str]) -> None:
    """A program sends neither header; a link of another site opens the page."""
    assert POLICY.refuses_origin({**HOST, **headers}) is None


@pytest.mark.parametrize(("control", "known", "status"), [(False, True, 403), (True, False, 401)])
def test_control_needs_the_option_and_a_token(*, control: bool, known: bool, status: int) -> None:
    """The status tells a missing option from a wrong token."""
    refusal = AccessPolicy(token="secret", control=control).refuses_control(known=known)
    assert refusal is not None
    assert refusal.status == status


def test_a_known_token_grants_control() -> None:
    """Where control is allowed."""
    assert POLICY.refuses_control(known=True) is None


def test_reading_needs_a_token_of_a_private_server_only() -> None:
    """On loopback everybody on this machine may read."""
    assert POLICY.refuses_reading(known=False) is None
    private = AccessPolicy(token="secret", private=True)
    assert private.refuses_reading(known=True) is None
    refusal = private.refuses_reading(known=False)
    assert refusal is not None
    assert refusal.status == 401


@pytest.mark.parametrize("token", ["", "sécret", "secret\udcff", "secre"])
def test_other_tokens_are_just_wrong(token: str) -> None:
    """They may come from anybody, as bytes that are no UTF-8, too."""
    assert POLICY.knows_token("secret")
    assert not POLICY.knows_token(token)


def test_who_presents_the_token_may_use_any_name() -> None:
    """Prometheus asks under the name that it was told; a page of another site cannot know the token."""
    known = {"Host": "robot.local:7412", "Authorization": "Bearer secret"}
    assert POLICY.refuses_origin(known) is None
    assert POLICY.refuses_origin({**known, "Authorization": "Bearer guess"}) is not None
    assert POLICY.refuses_origin({**known, "Origin": "http://evil.example"}) is not None


@pytest.mark.parametrize(
    ("header", "token"),
    [("Bearer abc", "abc"), ("bearer  abc ", "abc"), ("Basic abc", ""), ("Bearer", ""), ("", "")],
)
def test_the_token_comes_from_the_header(header: str, token: str) -> None:
    """Other schemes have none."""
    assert bearer({"Authorization": header}) == token


def test_tokens_differ() -> None:
    """Each server has its own."""
    assert new_token() != new_token()
