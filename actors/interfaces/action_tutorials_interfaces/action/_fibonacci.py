"""action_tutorials_interfaces/action/Fibonacci."""

import msgspec

from actors.interfaces.message import Action, Message
from actors.interfaces.types import Int32Array, Int32Sequence, int32


class Fibonacci(Action, type_name="action_tutorials_interfaces/action/Fibonacci"):
    """action_tutorials_interfaces/action/Fibonacci."""

    class Goal(Message):
        """The goal."""

        order: int32 = 0

    class Result(Message):
        """The result."""

        sequence: Int32Sequence = msgspec.field(default_factory=Int32Array)

    class Feedback(Message):
        """The feedback."""

        partial_sequence: Int32Sequence = msgspec.field(default_factory=Int32Array)
