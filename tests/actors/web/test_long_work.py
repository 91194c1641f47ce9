"""Work that grows with the graph or with messages is not done on the event loop, and not repeated."""

from __future__ import annotations

import asyncio
import threading
from typing import TYPE_CHECKING, Any, Final

import pytest

from actors.interfaces.example_interfaces.srv import AddTwoInts
from actors.interfaces.rcl_interfaces.msg import ParameterValue
from actors.interfaces.rcl_interfaces.srv import GetParameters
from actors.interfaces.std_msgs.msg import String
from actors.tools import graph_documents, overview
from actors.tools.overview import Samples
from actors.web import calls, javascript_values
from actors.web.live import echo_panel, overview_panel, panel
from actors.web.node_names import NODE_NAMES
from actors.web.observer import Observer
from actors.web.routes import calls as call_routes
from actors.web.routes import graph as graph_routes
from proto.wire.codes import EntryKind
from tests.actors.meeting import until
from tests.actors.web.site import Page

if TYPE_CHECKING:
    from types import ModuleType

    from actors.graph.snapshot import GraphSnapshot
    from tests.actors.meeting import Meeting
    from tests.actors.web.site import Site

DOCUMENTS: Final[tuple[tuple[str, Any, str], ...]] = (
    ("/api/graph", graph_routes, "document_of"),
    ("/api/topics", graph_documents, "topics"),
    ("/api/services", graph_documents, "services"),
    ("/api/actions", graph_documents, "actions"),
    ("/api/nodes", graph_documents, "nodes"),
    ("/api/overview", overview.Overview, "as_dict"),
    ("/api/overview", Samples, "add"),
    ("/api/topics/chatter", graph_documents, "mismatches_of"),
    ("/api/topics/chatter", Observer, "around"),
    ("/api/topics/chatter/form", call_routes, "form_of"),
)


class Calls:
    """The calls of a function, which goes on to work.

    Args:
        patch: Replaces it.
        owner: Has the function.
        name: Its name.
    """

    def __init__(self, patch: pytest.MonkeyPatch, owner: ModuleType | type, name: str) -> None:
        self.threads: list[threading.Thread] = []
        original = getattr(owner, name)

        def replacement(*args: Any, **kwargs: Any) -> Any:
            self.threads.append(threading.current_thread())
            return original(*args, **kwargs)

        patch.setattr(owner, name, replacement)


async def publish(meeting: Meeting, site: Site) -> None:
    """Add a topic."""
    node = await meeting.node("talker")
    node.create_publisher(String, "/chatter").publish(String(data="hello"))
    await site.json_found("/api/topics/chatter")


@pytest.mark.parametrize(("path", "owner", "name"), DOCUMENTS)
async def test_documents_are_made_in_the_thread(
    site: Site, meeting: Meeting, monkeypatch: pytest.MonkeyPatch, path: str, owner: Any, name: str
) -> None:
    """Case 77 and 78: each document of the graph, and forms."""
    await publish(meeting, site)
    made = Calls(monkeypatch, owner, name)
    await site.json(path)
    assert made.threads
    assert threading.main_thread() not in made.threads


async def test_a_document_is_made_once_for_all_who_ask(
    site: Site, meeting: Meeting, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Case 77: as long as the graph is the same; those who ask meanwhile wait for it."""
    await publish(meeting, site)
    made = Calls(monkeypatch, graph_routes, "document_of")
    found = await asyncio.gather(*(site.json("/api/graph") for _ in range(50)))
    assert all(each == found[0] for each in found)
    assert len(made.threads) == 1
    node = await meeting.node("listener")
    node.create_subscription(String, "/chatter", lambda _: None)
    await site.json_until("/api/graph", lambda graph: len(graph["nodes"]) == 2)
    assert len(made.threads) > 1


async def test_what_the_page_itself_reads_is_no_change_of_the_graph(
    site: Site, meeting: Meeting, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Case 77: streams open and close all the time; no document is made again for their subscriptions."""
    await publish(meeting, site)
    observer, reported = site.observer, list[int]()
    made = Calls(monkeypatch, graph_routes, "document_of")
    await site.json("/api/graph")
    seen, original = observer.snapshot, NODE_NAMES.without_own

    def without_own(snapshot: GraphSnapshot) -> GraphSnapshot:
        reported.append(snapshot.count(EntryKind.SUBSCRIPTION, "/chatter"))
        return original(snapshot)

    monkeypatch.setattr(NODE_NAMES, "without_own", without_own)
    own = observer.node.create_subscription(String, "/chatter", lambda _: None)
    await until(lambda: 1 in reported)
    observer.node.destroy_subscription(own)
    await until(lambda: reported[-1] == 0)
    assert observer.snapshot is seen
    await site.json("/api/graph")
    assert len(made.threads) == 1


async def test_panels_work_in_the_thread(
    site: Site, meeting: Meeting, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Case 77: differences of documents, and messages as trees of fields."""
    node = await meeting.node("talker")
    publisher = node.create_publisher(String, "/chatter")
    made = [
        Calls(monkeypatch, panel, "merge_patch"),
        Calls(monkeypatch, echo_panel, "message_to_javascript"),
        Calls(monkeypatch, overview_panel, "asdict"),
    ]
    async with site.client.ws_connect("/api/live") as socket:
        page = Page(socket)
        await page.open(1, "overview")
        await page.until(lambda news: news["id"] == 1 and news["patch"].get("topics"))
        await page.open(2, "echo", topic="/chatter")
        await publisher.wait_for_subscriptions(1)
        publisher.publish(String(data="hello"))
        await page.until(lambda news: news["id"] == 2)
    for each in made:
        assert each.threads
        assert threading.main_thread() not in each.threads


async def test_calls_are_converted_in_the_thread(
    control: Site, meeting: Meeting, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Case 77: requests and responses, which may have megabytes of values."""
    node = await meeting.node("adder")

    def add(request: AddTwoInts.Request, response: AddTwoInts.Response) -> AddTwoInts.Response:
        response.sum = request.a + request.b
        return response

    node.create_service(AddTwoInts, "/add", add)
    made = [Calls(monkeypatch, calls, "message_of"), Calls(monkeypatch, calls, "message_to_javascript")]
    answer = await control.json("/api/services/add", method="POST", json={"request": {"a": 1, "b": 2}})
    assert answer == {"response": {"sum": 3}}
    for each in made:
        assert each.threads
        assert threading.main_thread() not in each.threads


async def test_too_many_values_are_not_shown(
    control: Site, meeting: Meeting, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Case 78: the response of a node that a page cannot show is an error, and so is a message."""
    monkeypatch.setattr(javascript_values, "MAX_VALUES", 1000)
    node = await meeting.node("trigger")

    def many(_: GetParameters.Request, response: GetParameters.Response) -> GetParameters.Response:
        response.values = [ParameterValue(integer_array_value=[1, 2, 3])] * 200
        return response

    node.create_service(GetParameters, "/many", many)
    answer = await control.json("/api/services/many", 502, "POST", json={})
    assert "more than 1000 values" in answer["error"]
