"""The operations that a client of rosbridge sends, checked. Pure.

Each is a JSON object whose `op` names it. A client may send fields that are not known here: versions of
roslib and roslibpy differ in them.
"""

from __future__ import annotations

from typing import Annotated, Any, ClassVar, Final, Literal, TypeAlias

import msgspec

from actors.web.json_decoding import decode_json
from proto.errors import CallboardError
from proto.untrusted_text import escape

MAX_QUOTED: Final = 200
"""Characters of a client's text that an error quotes."""

MAX_ID: Final = 1000
"""Characters of an id: it is kept as long as its subscription, call or goal."""

Text = Annotated[str, msgspec.Meta(max_length=MAX_ID)]
Id: TypeAlias = Text | int | float | None
Count = Annotated[int, msgspec.Meta(ge=0, le=2**31 - 1)]
Milliseconds = Annotated[float, msgspec.Meta(ge=0, le=1e9)]
FragmentSize = Annotated[int, msgspec.Meta(ge=1)]
Arguments: TypeAlias = dict[str, Any] | list[Any] | None
"""The values of a request or goal by name, or in the order of the fields."""

Compression: TypeAlias = Literal["none", "png", "cbor", "cbor-raw"]
Level: TypeAlias = Literal["info", "warning", "error", "none"]


class OperationError(CallboardError):
    """What a client has sent is no operation, or not a valid one.

    Args:
        text: Why.
        id: The id that the client gave, if it can be read.
        operation: The name of the operation, if it can be read.
    """

    def __init__(self, text: str, id: Id = None, operation: str = "") -> None:  # noqa: A002 - the protocol's word
        super().__init__(text)
        self.id, self.operation = id, operation


class Operation(msgspec.Struct, frozen=True, kw_only=True, tag_field="op"):
    """Base of all operations.

    Attributes:
        id: As given; answers and status messages repeat it.
        controls: Whether it changes anything in the graph, which needs control.
    """

    controls: ClassVar[bool] = True
    id: Id = None


class Advertise(Operation, frozen=True, kw_only=True, tag="advertise"):
    """The client will publish.

    Attributes:
        topic: The topic, as the client calls it.
        type: The message type; "std_msgs/String" is "std_msgs/msg/String".
        latch: Whether the last message is kept for later subscriptions.
        queue_size: The publisher's depth.
    """

    topic: Text
    type: Text
    latch: bool | None = None
    queue_size: Count | None = None


class Unadvertise(Operation, frozen=True, kw_only=True, tag="unadvertise"):
    """The client will not publish any more."""

    topic: Text


class Publish(Operation, frozen=True, kw_only=True, tag="publish"):
    """A message.

    Attributes:
        topic: The topic.
        msg: The values of its fields.
        latch: As for `Advertise`, if the topic has not been advertised.
    """

    topic: Text
    msg: dict[str, Any] = {}
    latch: bool | None = None


class Subscribe(Operation, frozen=True, kw_only=True, tag="subscribe"):
    """The client wants the messages of a topic.

    Attributes:
        topic: The topic.
        type: Its type, if the client knows it.
        throttle_rate: The least time between two messages, in ms.
        queue_length: Messages that wait because of it; the oldest makes room.
        fragment_size: Characters of the largest frame; larger ones are sent as fragments.
        compression: How messages are sent.
    """

    controls = False
    topic: Text
    type: Text | None = None
    throttle_rate: Milliseconds | None = None
    queue_length: Count | None = None
    fragment_size: FragmentSize | None = None
    compression: Compression | None = None


class Unsubscribe(Operation, frozen=True, kw_only=True, tag="unsubscribe"):
    """The client does not want them any more: the subscription of this id, or all of the topic."""

    controls = False
    topic: Text


class CallService(Operation, frozen=True, kw_only=True, tag="call_service"):
    """A call.

    Attributes:
        service: The service.
        type: Its type, which is needed only if the graph has several.
        args: The request.
        fragment_size: As for `Subscribe`, for the response.
        compression: How the response is sent.
        timeout: Seconds for the response; the node's deadline if it is missing.
    """

    service: Text
    type: Text | None = None
    args: Arguments = None
    fragment_size: FragmentSize | None = None
    compression: Compression | None = None
    timeout: Annotated[float, msgspec.Meta(ge=0, le=1e9)] | None = None


class AdvertiseService(Operation, frozen=True, kw_only=True, tag="advertise_service"):
    """The client serves requests, which it gets as `call_service`."""

    service: Text
    type: Text


class UnadvertiseService(Operation, frozen=True, kw_only=True, tag="unadvertise_service"):
    """The client does not serve them any more."""

    service: Text


class ServiceResponse(Operation, frozen=True, kw_only=True, tag="service_response"):
    """The response to a request that the client has got.

    Attributes:
        service: The service.
        values: The response; a text if the call has failed.
        result: Whether it has succeeded.
    """

    service: Text
    values: dict[str, Any] | list[Any] | str | None = None
    result: bool = True


class SendActionGoal(Operation, frozen=True, kw_only=True, tag="send_action_goal"):
    """A goal.

    Attributes:
        action: The action.
        action_type: Its type.
        args: The goal.
        feedback: Whether the client wants feedback.
        fragment_size: As for `Subscribe`, for feedback and the result.
        compression: How feedback and the result are sent.
    """

    action: Text
    action_type: Text
    args: Arguments = None
    feedback: bool | None = None
    fragment_size: FragmentSize | None = None
    compression: Compression | None = None


class CancelActionGoal(Operation, frozen=True, kw_only=True, tag="cancel_action_goal"):
    """Cancel the goal of this id."""

    action: Text


class AdvertiseAction(Operation, frozen=True, kw_only=True, tag="advertise_action"):
    """The client executes goals, which it gets as `send_action_goal`."""

    action: Text
    type: Text


class UnadvertiseAction(Operation, frozen=True, kw_only=True, tag="unadvertise_action"):
    """The client does not execute them any more."""

    action: Text


class ActionFeedback(Operation, frozen=True, kw_only=True, tag="action_feedback"):
    """Feedback for a goal that the client has got."""

    action: Text
    values: dict[str, Any] = {}


class ActionResult(Operation, frozen=True, kw_only=True, tag="action_result"):
    """The end of a goal that the client has got.

    Attributes:
        action: The action.
        values: The result.
        status: That of action_msgs/msg/GoalStatus.
        result: Whether there is a result; if not, the goal is aborted.
    """

    action: Text
    values: dict[str, Any] | list[Any] | str | None = None
    status: int = 0
    result: bool = True


class SetLevel(Operation, frozen=True, kw_only=True, tag="set_level"):
    """Which status messages the client wants: those of this level, and of worse ones."""

    controls = False
    level: Level


class Fragment(Operation, frozen=True, kw_only=True, tag="fragment"):
    """A part of an operation that is too large for one frame.

    Attributes:
        data: A part of its JSON.
        num: Which, from 0.
        total: How many there are.
    """

    controls = False
    data: str
    num: Count
    total: Annotated[int, msgspec.Meta(ge=1)]


class Authenticate(Operation, frozen=True, kw_only=True, tag="auth"):
    """Of old versions, which nothing asks for any more: roslib still has it. Ignored."""

    controls = False


class _Outline(msgspec.Struct):
    """What an error says of an operation that is not valid."""

    op: Any = None
    id: Any = None


AnyOperation: TypeAlias = (
    Advertise
    | Unadvertise
    | Publish
    | Subscribe
    | Unsubscribe
    | CallService
    | AdvertiseService
    | UnadvertiseService
    | ServiceResponse
    | SendActionGoal
    | CancelActionGoal
    | AdvertiseAction
    | UnadvertiseAction
    | ActionFeedback
    | ActionResult
    | SetLevel
    | Fragment
    | Authenticate
)
NAMES: Final = tuple(sorted(str(each.__struct_config__.tag) for each in Operation.__subclasses__()))
_decoder: Final[msgspec.json.Decoder[AnyOperation]] = msgspec.json.Decoder(AnyOperation)


def decode_operation(data: str | bytes) -> AnyOperation:
    """Return the operation in a frame.

    Args:
        data: JSON.

    Raises:
        OperationError: It is none, or not valid.
    """
    try:
        return _decoder.decode(data)
    except (msgspec.DecodeError, UnicodeDecodeError, RecursionError) as error:
        raise _explained(data, error) from None


def _explained(data: str | bytes, error: Exception) -> OperationError:
    try:
        outline = decode_json(data, _Outline)
    except msgspec.DecodeError as malformed:
        return OperationError(f"Not an operation in JSON: {_short(str(malformed))}")
    name, id_ = outline.op, outline.id
    known = isinstance(id_, str | int | float) and len(str(id_)) <= MAX_ID
    kept: Id = id_ if known else None
    if not isinstance(name, str):
        return OperationError("An operation needs its name, a string, in the field 'op'", kept)
    if name not in NAMES:
        return OperationError(
            f"Unknown operation '{_short(escape(name))}'; there are {', '.join(NAMES)}", kept
        )
    return OperationError(f"{name}: {_short(str(error))}", kept, name)


def _short(text: str) -> str:
    return text if len(text) <= MAX_QUOTED else f"{text[:MAX_QUOTED]}…"
