"""What a broker in a mesh logs about the others."""

from __future__ import annotations

from typing import Any
from unittest import mock

from broker.mesh.engine.member import MeshMember
from broker.mesh.messages import Snapshot
from broker.options import BrokerOptions
from broker.routing.router import Router


def test_a_warning_names_the_broker_if_its_name_is_known() -> None:
    """Control characters of the name are escaped."""
    lines: list[str] = []
    dispatcher: Any = mock.Mock(options=BrokerOptions())
    dispatcher.admission.rules = None

    def warn(_reason: str, text: str, *values: object) -> None:
        lines.append(text % values)

    dispatcher.warnings.warn = warn
    engine: Any = mock.Mock()
    member = MeshMember(1, dispatcher, lambda _number, _host: engine, "here")
    mesh = member.add(Router()).mesh
    for broker in (2, 3):
        mesh.add_broker(broker)
    mesh.accept_snapshot(2, Snapshot(1, 0, (), "robot\n"))
    for broker in (2, 3):
        mesh.reject(broker, "why")
    assert lines == [
        "Mesh: rejected the broker robot\\n (00000002): why",
        "Mesh: rejected the broker 00000003: why",
    ]
