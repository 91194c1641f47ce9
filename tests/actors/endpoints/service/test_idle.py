"""Standard services before and after their first request."""

from __future__ import annotations

from typing import TYPE_CHECKING

from actors.interfaces.rcl_interfaces.srv import GetParameters, ListParameters
from tests.actors.meeting import until

if TYPE_CHECKING:
    import actors
    from tests.actors.meeting import Meeting


def served(node: actors.Node) -> dict[tuple[int, str, str], int]:
    """Return the requests that each service of a node has answered, by id, name and callback."""
    return {(each.id, each.service, each.callback.name): each.served for each in node.diagnostics().services}


async def test_only_the_counts_of_a_service_change_with_its_first_request(meeting: Meeting) -> None:
    """All are listed and declared from the start; a call changes neither the order nor the ids."""
    server = await meeting.node("server", start_parameter_services=True)
    asker = await meeting.node("asker")
    server.declare_parameter("speed", 3)
    client = asker.create_client(GetParameters, "/server/get_parameters")
    assert await client.wait_for_service(20)
    before = served(server)
    assert len(before) == 6
    assert not any(before.values())
    for _ in range(2):
        response = await client.call(GetParameters.Request(names=["speed"]))
        assert response.values[0].integer_value == 3
    after = served(server)
    assert list(after) == list(before)
    assert [number for (_, name, _), number in after.items() if name == client.srv_name] == [2]
    assert sum(after.values()) == 2


async def test_services_leave_with_their_node_called_or_not(meeting: Meeting) -> None:
    """Clients of both notice it at once."""
    server = await meeting.node("server", start_parameter_services=True)
    asker = await meeting.node("asker")
    called = asker.create_client(GetParameters, "/server/get_parameters")
    idle = asker.create_client(ListParameters, "/server/list_parameters")
    assert await called.wait_for_service(20)
    assert await idle.wait_for_service(20)
    await called.call(GetParameters.Request())
    server.destroy_node()
    await until(lambda: not (called.peers or idle.peers))
