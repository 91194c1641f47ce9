"""Simulated time from the topic `/clock`, while the node's parameter `use_sim_time` is set.

A message sets the time where it arrives and not through the mailbox: a callback that holds the mailbox may be
sleeping until that very time.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from actors.endpoints.subscription.endpoint import SubscriptionEndpoint
from actors.qos.profile import QoSProfile, ReliabilityPolicy
from actors.time.types import NANOSECONDS_PER_SECOND

if TYPE_CHECKING:
    from actors.arguments.remapping import Remapper
    from actors.endpoints.context import NodeContext
    from actors.parameters.changes import ParameterChanges
    from actors.parameters.store import ParameterStore
    from actors.session.attachments import Attachment
    from proto.wire.frames import Batch, Replay

CLOCK_TOPIC: Final = "/clock"
USE_SIM_TIME: Final = "use_sim_time"


class TimeSource:
    """Attaches a node's clock to `/clock`, and detaches it, as the parameter says.

    Args:
        context: The node.
        names: Remaps the topic.
        parameters: The node's parameters.
    """

    def __init__(self, context: NodeContext, names: Remapper, parameters: ParameterStore) -> None:
        self._context = context
        self._names = names
        self._subscription: ClockSubscription | None = None
        parameters.listeners.append(self._changed)
        if parameters.get(USE_SIM_TIME).value is True:
            self._attach()

    def _changed(self, changes: ParameterChanges) -> None:
        for parameter in (*changes.new, *changes.changed):
            if parameter.name == USE_SIM_TIME:
                if parameter.value is True:
                    self._attach()
                else:
                    self._detach()

    def _attach(self) -> None:
        if self._subscription is None and not self._context.destroyed:
            # Made before the source changes: if it cannot be made, the node keeps the wall clock, and not a
            # time that never comes.
            self._subscription = ClockSubscription(self._context, self._names.resolve_topic(CLOCK_TOPIC))
            self._context.ros_time.activate(active=True)

    def _detach(self) -> None:
        if self._subscription is not None:
            self._subscription.destroy()
            self._subscription = None
            self._context.ros_time.activate(active=False)


class ClockSubscription(SubscriptionEndpoint):
    """Sets the simulated time of a node to that of the newest message.

    Args:
        context: The node.
        topic: The topic's full name.
    """

    def __init__(self, context: NodeContext, topic: str) -> None:
        from actors.interfaces.rosgraph_msgs.msg import Clock  # noqa: PLC0415 - only with simulated time

        qos = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)
        super().__init__(context, Clock, topic, None, qos, concurrent=False, event_callbacks=None, raw=False)

    def receive(self, attachment: Attachment, batch: Batch | Replay) -> None:
        """Reader: set the time."""
        super().receive(attachment, batch)
        consumer = self.consumer
        # Depth 1: only the newest message is there. An older time would be a step back.
        while consumer.backlog.pending:
            stamp = consumer.backlog.pop().clock
            consumer.calls += 1
            if stamp.sec >= 0:
                self.context.ros_time.set(stamp.sec * NANOSECONDS_PER_SECOND + stamp.nanosec)
            # Limited: a broken `/clock` comes a thousand times a second.
            elif self.context.may_log("negative times"):
                self.context.log.warning(f"Ignored a negative time of {CLOCK_TOPIC}: {stamp.sec} s")

    def retire(self) -> None:
        """Go on while the node stops, so that callbacks that sleep may end; `destroy` follows."""
