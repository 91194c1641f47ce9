"""How many connections fit into the files that a process may open."""

from __future__ import annotations

import resource

import pytest

from broker.serving import capacity
from broker.serving.capacity import Capacity


@pytest.fixture
def files(monkeypatch: pytest.MonkeyPatch, request: pytest.FixtureRequest) -> int:
    """A limit of open files."""
    limit: int = request.param
    monkeypatch.setattr(resource, "getrlimit", lambda _: (limit, limit))
    return limit


@pytest.mark.parametrize(
    ("files", "wanted", "most"),
    [
        (20_000, 20_000, 20_000 - capacity.RESERVED_FILES),
        (1024, 20_000, 512),
        (1024, 100, 100),
        (64, 20_000, 32),
        (resource.RLIM_INFINITY, 20_000, 20_000),
    ],
    indirect=["files"],
)
@pytest.mark.usefixtures("files")
def test_connections_leave_descriptors_for_other_files(wanted: int, most: int) -> None:
    """A broker takes as many as wanted if they fit; of a small limit half."""
    assert Capacity(wanted).most == most


@pytest.mark.parametrize("files", [16, 64, 1024, 4096, 20_000], indirect=True)
def test_a_whole_backlog_fits(files: int) -> None:
    """asyncio accepts a whole backlog before one of it can be refused."""
    found = Capacity(1_000_000)
    assert 1 <= found.backlog <= capacity.MAX_BACKLOG
    assert found.most + found.backlog < files


@pytest.mark.parametrize(
    ("files", "wanted", "remedy"), [(64, 999, "ulimit"), (1024, 9, "--max-connections")], indirect=["files"]
)
@pytest.mark.usefixtures("files")
def test_a_refusal_names_the_limit(wanted: int, remedy: str) -> None:
    """Clients and the log learn what to change."""
    full = Capacity(wanted)
    assert str(full.most) in full.refusal
    assert remedy in full.refusal
