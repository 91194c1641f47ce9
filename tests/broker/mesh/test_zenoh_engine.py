"""What the engine does with tokens of brokers that it cannot talk to."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING
from unittest import mock

import zenoh

from broker.mesh.engine.sending_thread import MAX_QUEUED_BYTES
from broker.mesh.engine.zenoh_config import make_config
from broker.mesh.engine.zenoh_engine import MAX_OTHERS, VERSION, ZenohEngine
from broker.mesh.messages import Publish, Subscribe
from broker.options import BrokerOptions
from proto.aio.read_budget import ReadBudget
from tests.seams.brokers import see_token, use_session

if TYPE_CHECKING:
    import pytest


def make_engine() -> ZenohEngine:
    """Return an engine that has not been started."""
    budget = ReadBudget(asyncio.get_running_loop())
    return ZenohEngine(1, mock.Mock(), budget, make_config(BrokerOptions(mesh="tcp/127.0.0.1:1")))


async def test_the_traffic_of_a_broker_is_kept_while_it_is_there() -> None:
    """Brokers that come and go, each with another number, must not add up."""
    engine, key = make_engine(), f"callboard/{VERSION}/0/alive/2"
    see_token(engine, key, zenoh.SampleKind.PUT)
    assert [*engine.statistics().traffic] == [2]
    see_token(engine, key, zenoh.SampleKind.DELETE)
    assert not engine.statistics().traffic


async def test_an_engine_is_full_of_what_waits_to_be_sent() -> None:
    """Here its thread does not run."""
    engine, part = make_engine(), Publish("/large", bytes(MAX_QUEUED_BYTES // 3))
    for full in (False, False, True):
        engine.send(0, [part])
        assert engine.full is full


async def test_a_topic_that_nobody_wants_any_more_is_not_received() -> None:
    """Its subscription to other brokers' messages ends, and a new one begins when it is wanted again."""
    engine, session = make_engine(), mock.Mock()
    use_session(engine, session)
    engine.send(0, [Subscribe("/topic", wanted=True), Subscribe("/topic", wanted=False)])
    session.declare_subscriber.return_value.undeclare.assert_called_once_with()
    engine.send(0, [Subscribe("/topic", wanted=True)])
    assert session.declare_subscriber.call_count == 2


async def test_brokers_of_other_versions_are_logged_once_each_and_to_a_limit(
    caplog: pytest.LogCaptureFixture,
) -> None:
    """Anybody in the mesh can claim to be as many brokers as he likes."""
    engine = make_engine()
    for number in (*range(MAX_OTHERS + 10), 0, MAX_OTHERS):
        see_token(engine, f"callboard/0/0/alive/broker-{number}")
    assert [record.getMessage().split()[3] for record in caplog.records] == [
        f"broker-{number}" for number in range(MAX_OTHERS)
    ]
