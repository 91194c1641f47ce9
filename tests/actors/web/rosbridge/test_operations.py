"""What is an operation, and what the errors for everything else say."""

from __future__ import annotations

import json

import pytest

from actors.web.rosbridge.operations import (
    NAMES,
    OperationError,
    Publish,
    Subscribe,
    decode_operation,
)


def test_an_operation_is_read() -> None:
    """With fields that are not known, in any order; in a binary frame, too."""
    text = '{"topic": "/a", "queue_size": 3, "color": "red", "msg": {"data": 1}, "op": "publish", "id": 7}'
    for data in (text, text.encode()):
        assert decode_operation(data) == Publish(id=7, topic="/a", msg={"data": 1})


def test_a_client_may_send_null() -> None:
    """For what is optional: roslib does."""
    fields = {"throttle_rate": None, "queue_length": None, "fragment_size": None, "compression": None}
    assert decode_operation(json.dumps({"op": "subscribe", "topic": "a", **fields})) == Subscribe(topic="a")


@pytest.mark.parametrize(
    ("data", "id_", "text"),
    [
        ("", None, "Not an operation in JSON"),
        ("{", None, "Not an operation in JSON"),
        ("[" * 100_000, None, "Not an operation in JSON"),
        (b'{"op": "\xff"}', None, "UTF-8"),
        ("[1]", None, "Not an operation in JSON"),
        ('{"id": "x"}', "x", "needs its name"),
        ('{"op": 3, "id": 4}', 4, "needs its name"),
        ('{"op": "dance", "id": "x"}', "x", "Unknown operation 'dance'; there are action_feedback, "),
        ('{"op": "dance\\n", "id": {}}', None, r"Unknown operation 'dance\\n'"),
        ('{"op": "publish", "id": "x"}', "x", "publish: Object missing required field `topic`"),
        ('{"op": "publish", "topic": 1}', None, r"publish: Expected `str`, got `int` - at `\$.topic`"),
        ('{"op": "publish", "topic": "a", "msg": []}', None, "Expected `object`, got `array`"),
        ('{"op": "subscribe", "topic": "a", "compression": "zip"}', None, "Invalid enum value 'zip'"),
        ('{"op": "subscribe", "topic": "a", "throttle_rate": -1}', None, ">= 0"),
        ('{"op": "subscribe", "topic": "a", "fragment_size": 0}', None, ">= 1"),
        ('{"op": "set_level", "level": "loud"}', None, "Invalid enum value 'loud'"),
        ('{"op": "fragment", "data": "", "num": -1, "total": 1}', None, ">= 0"),
        (json.dumps({"op": "x" * 10_000}), None, "…"),
        (json.dumps({"op": "dance", "id": "x" * 10_000}), None, "Unknown operation"),
    ],
)
def test_everything_else_is_an_error(data: str | bytes, id_: object, text: str) -> None:
    """It has the id, if that can be read, and says what is wrong."""
    with pytest.raises(OperationError, match=text) as caught:
        decode_operation(data)
    assert caught.value.id == id_
    assert len(str(caught.value)) < 1000


def test_all_operations_of_the_protocol_are_known() -> None:
    """Of rosbridge 2.1 for ROS 2; the others are for clients only."""
    assert {
        "advertise", "unadvertise", "publish", "subscribe", "unsubscribe", "call_service", "service_response",
        "advertise_service", "unadvertise_service", "send_action_goal", "cancel_action_goal",
        "advertise_action", "unadvertise_action", "action_feedback", "action_result", "set_level", "fragment",
    } <= set(NAMES)  # fmt: skip
