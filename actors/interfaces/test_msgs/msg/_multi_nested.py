"""test_msgs/msg/MultiNested."""

from typing import Annotated

import msgspec

from actors.interfaces.message import Message
from actors.interfaces.test_msgs.msg._arrays import Arrays
from actors.interfaces.test_msgs.msg._bounded_sequences import BoundedSequences
from actors.interfaces.test_msgs.msg._unbounded_sequences import UnboundedSequences
from actors.interfaces.types import AtMost, Length


class MultiNested(Message, type_name="test_msgs/msg/MultiNested"):
    """test_msgs/msg/MultiNested."""

    array_of_arrays: Annotated[list[Arrays], Length(3)] = msgspec.field(
        default_factory=lambda: [Arrays() for _ in range(3)]
    )
    array_of_bounded_sequences: Annotated[list[BoundedSequences], Length(3)] = msgspec.field(
        default_factory=lambda: [BoundedSequences() for _ in range(3)]
    )
    array_of_unbounded_sequences: Annotated[list[UnboundedSequences], Length(3)] = msgspec.field(
        default_factory=lambda: [UnboundedSequences() for _ in range(3)]
    )
    bounded_sequence_of_arrays: Annotated[list[Arrays], AtMost(3)] = msgspec.field(
        default_factory=list[Arrays]
    )
    bounded_sequence_of_bounded_sequences: Annotated[list[BoundedSequences], AtMost(3)] = msgspec.field(
        default_factory=list[BoundedSequences]
    )
    bounded_sequence_of_unbounded_sequences: Annotated[list[UnboundedSequences], AtMost(3)] = msgspec.field(
        default_factory=list[UnboundedSequences]
    )
    unbounded_sequence_of_arrays: list[Arrays] = msgspec.field(default_factory=list[Arrays])
    unbounded_sequence_of_bounded_sequences: list[BoundedSequences] = msgspec.field(
        default_factory=list[BoundedSequences]
    )
    unbounded_sequence_of_unbounded_sequences: list[UnboundedSequences] = msgspec.field(
        default_factory=list[UnboundedSequences]
    )
