"""What follows from the messages of one client, and what it is sent next. Pure: no I/O, no clock.

    session = Session(info, control_refusal="")
    for command in session.receive(text):    # what to do: subscribe, publish, call, ...
        ...
    session.set_channels(channels)           # what has happened
    session.add_message(subscription_id, message, size)
    while frame := session.next():           # what to send, when the client can take it
        ...

State is not queued: what a client is sent of channels, services, the graph, parameters and the time is the
difference between what it has been sent and what is so when it can take more. Messages wait in a `SendQueue`.
"""

from __future__ import annotations

from itertools import islice
from typing import TYPE_CHECKING, Any, Final, Generic, NamedTuple, TypeAlias, TypeVar

from actors.web.foxglove import messages as wire
from actors.web.foxglove.answers import Answers, Frame
from actors.web.send_queue import SendQueue

if TYPE_CHECKING:
    from collections.abc import Mapping

M = TypeVar("M")
T = TypeVar("T")

CAPABILITIES: Final = ("parameters", "parametersSubscribe", "connectionGraph", "assets")
CONTROL_CAPABILITIES: Final = ("clientPublish", "services")
TIME_CAPABILITY: Final = "time"
ENCODINGS: Final = ("cdr", "json")
"""In which clients publish and call."""

ITEMS_PER_FRAME: Final = 100
"""Channels, services and parameters in one text: their definitions have some KiB each."""

MAX_SUBSCRIPTIONS: Final = 2000
"""Channels that one client subscribes to."""

MAX_CLIENT_CHANNELS: Final = 256
"""Channels on which one client publishes."""

MAX_CALLS: Final = 64
"""Calls of one client that wait for their responses."""

MAX_FETCHES: Final = 256
"""Files that one client waits for."""

MAX_PARAMETERS: Final = 10_000
"""Parameters that one client names to watch them, or to leave them out when it watches all."""

SHOWN_TOPICS: Final = 3
"""Topics that are named when messages were dropped."""

DROPS: Final = "callboard.drops"
"""The id of the status about dropped messages."""


class OpenSubscription(NamedTuple):
    """Begin to call `Session.add_message` with the messages of a channel."""

    subscription_id: int
    channel: wire.Channel


class CloseSubscription(NamedTuple):
    """End it."""

    subscription_id: int


class OpenPublisher(NamedTuple):
    """Make a publisher."""

    channel: wire.ClientChannel


class ClosePublisher(NamedTuple):
    """End a publisher."""

    channel_id: int


class Publish(NamedTuple):
    """Publish a message of a client."""

    channel: wire.ClientChannel
    payload: bytes


class Call(NamedTuple):
    """Call a service, then `Session.finish_call`."""

    service: wire.Service
    request: wire.ServiceCall


Command: TypeAlias = (
    OpenSubscription
    | CloseSubscription
    | OpenPublisher
    | ClosePublisher
    | Publish
    | Call
    | wire.GetParameters
    | wire.SetParameters
    | wire.FetchAsset
    | wire.SubscribeParameterUpdates
)
"""What to do for a client."""


class Due(NamedTuple, Generic[M]):
    """A message to send with `messages.message_data`, once it is encoded.

    Attributes:
        subscription_id: Of the client.
        channel: Of the message.
        message: As given to `Session.add_message`.
    """

    subscription_id: int
    channel: wire.Channel
    message: M


class Connections(NamedTuple):
    """The graph as clients see it: nodes by topic or service."""

    published: Mapping[str, tuple[str, ...]] = {}
    subscribed: Mapping[str, tuple[str, ...]] = {}
    served: Mapping[str, tuple[str, ...]] = {}


class _Announced(Generic[T]):
    """Channels or services: those that there are, and those of which the client knows."""

    def __init__(self) -> None:
        self.present: Mapping[int, T] = {}
        self._known: dict[int, T] = {}
        self._due = self._has_begun = False

    def set(self, present: Mapping[int, T]) -> None:
        """Replace those that there are, by id; an id never gets another meaning."""
        self.present, self._due = present, True

    def next(self) -> tuple[list[int], list[T]] | None:
        """Return the ids of those that have gone, or some new ones; None if the client knows all.

        The first time there may be no new ones: the protocol wants one announcement at least.
        """
        if not self._due:
            return None
        if gone := [each for each in self._known if each not in self.present]:
            for each in gone:
                del self._known[each]
            return gone, []
        new = dict(
            islice((each for each in self.present.items() if each[0] not in self._known), ITEMS_PER_FRAME)
        )
        if not new and self._has_begun:
            self._due = False
            return None
        self._has_begun = True
        self._known.update(new)
        return [], [*new.values()]


class Session(Generic[M]):
    """One client.

    Args:
        name: The server's, as clients show it.
        session_id: The server's; another one for each start.
        control_refusal: Why the client may only read; "" if it may publish, call and set parameters.

    Attributes:
        answers: What the client is told besides; the owner adds to it.
        watches_graph: Whether the client wants to know who is connected to whom.
    """

    def __init__(self, name: str, session_id: str, control_refusal: str) -> None:
        self._name, self._session_id, self._refusal = name, session_id, control_refusal
        self._clocks = 0
        """How often a clock has begun or ended: odd while there is one."""
        self._is_info_due = True
        self.answers = Answers()
        self._channels: _Announced[wire.Channel] = _Announced()
        self._services: _Announced[wire.Service] = _Announced()
        self._graph = self._known_graph = Connections()
        self._parameters: dict[str, Mapping[str, Any]] = {}
        """Changed ones, by name."""
        self._time_ns = 0
        """What is due; 0 if nothing is."""
        self._subscriptions: dict[int, wire.Channel] = {}
        self._queue: SendQueue[int, M] = SendQueue()
        self._dropped = 0
        self._publishers: dict[int, wire.ClientChannel] = {}
        self._calls = self._fetches = 0
        self.watches_graph = False
        self._watched: set[str] = set()
        """Names of parameters whose changes the client wants to know, or all except these."""
        self._watches_all = False

    # From the client

    def receive(self, message: str | bytes) -> list[Command]:
        """Handle a message of the client.

        Args:
            message: A text or bytes.

        Returns:
            What to do for it.
        """
        try:
            found = wire.parse(message)
        except wire.ProtocolError as error:
            self.answers.report(wire.ERROR, str(error))
            return []
        problems: list[str] = []
        commands = self._handle(found, problems)
        if problems:
            more = f" (and {len(problems) - 1} more problems)" if len(problems) > 1 else ""
            self.answers.report(wire.ERROR, problems[0] + more)
        return commands

    def _handle(  # noqa: C901, PLR0911 - a table of the protocol
        self, message: wire.ClientMessage, problems: list[str]
    ) -> list[Command]:
        match message:
            case wire.MessageData():
                return self._publish(message, problems)
            case wire.Subscribe():
                return self._subscribe(message, problems)
            case wire.Unsubscribe():
                return [*self._close_subscriptions(message.subscription_ids)]
            case wire.ServiceCall():
                return self._call(message)
            case wire.Advertise():
                return self._open_publishers(message, problems)
            case wire.Unadvertise():
                known = [each for each in message.channel_ids if self._publishers.pop(each, None)]
                return [ClosePublisher(each) for each in known]
            case wire.SubscribeConnectionGraph() | wire.UnsubscribeConnectionGraph():
                self.watches_graph = isinstance(message, wire.SubscribeConnectionGraph)
                self._known_graph = Connections()  # all of it if it is asked for again
                return []
            case wire.UnsubscribeParameterUpdates():
                self._watch_parameters(message.parameter_names, problems, end=True)
                return []
            case wire.SubscribeParameterUpdates():
                watches = self._watch_parameters(message.parameter_names, problems, end=False)
                return [message] if watches else []
            case wire.SetParameters() if self._refusal:
                problems.append(self._refusal)
                return []
            case wire.FetchAsset():
                return self._fetch(message)
            case wire.GetParameters() | wire.SetParameters():
                return [message]

    def _subscribe(self, message: wire.Subscribe, problems: list[str]) -> list[Command]:
        commands: list[Command] = []
        subscribed = {each.id for each in self._subscriptions.values()}
        for number, channel_id in ((each.id, each.channel_id) for each in message.subscriptions):
            channel = self._channels.present.get(channel_id)
            if channel is None:
                problems.append(f"There is no channel {channel_id}")
            elif number in self._subscriptions:
                problems.append(f"There is a subscription {number} already")
            elif channel_id in subscribed:
                problems.append(f"There is a subscription to '{channel.topic}' already")
            elif len(self._subscriptions) >= MAX_SUBSCRIPTIONS:
                problems.append(f"{MAX_SUBSCRIPTIONS} channels are subscribed to already")
            else:
                subscribed.add(channel_id)
                self._subscriptions[number] = channel
                self._queue.open(number)
                commands.append(OpenSubscription(number, channel))
        return commands

    def _close_subscriptions(self, numbers: list[int]) -> list[CloseSubscription]:
        commands: list[CloseSubscription] = []
        for number in numbers:
            if self._subscriptions.pop(number, None) is not None:
                self._queue.close(number)
                commands.append(CloseSubscription(number))
        return commands

    def _open_publishers(self, message: wire.Advertise, problems: list[str]) -> list[Command]:
        if self._refusal:
            problems.append(self._refusal)
            return []
        commands: list[Command] = []
        for each in message.channels:
            if each.id in self._publishers:
                problems.append(f"There is a client's channel {each.id} already")
            elif each.encoding not in ENCODINGS:
                problems.append(f"'{each.topic}': the encoding is none of {', '.join(ENCODINGS)}")
            elif len(self._publishers) >= MAX_CLIENT_CHANNELS:
                problems.append(f"{MAX_CLIENT_CHANNELS} channels are advertised already")
            else:
                self._publishers[each.id] = each
                commands.append(OpenPublisher(each))
        return commands

    def _publish(self, message: wire.MessageData, problems: list[str]) -> list[Command]:
        channel = self._publishers.get(message.channel_id)
        if channel is None:
            problems.append(f"There is no client's channel {message.channel_id}")
            return []
        return [Publish(channel, message.payload)]

    def _call(self, request: wire.ServiceCall) -> list[Command]:
        service = self._services.present.get(request.service_id)
        refusal = self._refusal
        if not refusal and service is None:
            refusal = f"There is no service {request.service_id}"
        elif not refusal and request.encoding not in ENCODINGS:
            refusal = f"The encoding is none of {', '.join(ENCODINGS)}"
        elif not refusal and self._calls >= MAX_CALLS:
            refusal = f"{MAX_CALLS} calls wait for their responses already"
        if refusal or service is None:
            self.answers.add(wire.service_call_failure(request.service_id, request.call_id, refusal))
            return []
        self._calls += 1
        return [Call(service, request)]

    def _watch_parameters(self, names: list[str], problems: list[str], *, end: bool) -> bool:
        """Begin or end to watch some parameters, all without names; return whether that was possible."""
        if not names:
            self._watched, self._watches_all = set(), not end
        elif end is not self._watches_all:
            self._watched.difference_update(names)
        elif len(self._watched.union(names)) > MAX_PARAMETERS:
            done = "left out" if end else "watched"
            problems.append(f"More than {MAX_PARAMETERS} parameters would be {done}")
            return False
        else:
            self._watched.update(names)
        return True

    def _fetch(self, message: wire.FetchAsset) -> list[Command]:
        if self._fetches >= MAX_FETCHES:
            failure = wire.asset_failure(message.request_id, f"{MAX_FETCHES} files are being fetched already")
            self.answers.add(failure, is_text=False)
            return []
        self._fetches += 1
        return [message]

    # From the graph

    def set_channels(self, channels: Mapping[int, wire.Channel]) -> list[CloseSubscription]:
        """Replace the channels that there are.

        Args:
            channels: By id.

        Returns:
            The ends of subscriptions to those that are gone.
        """
        self._channels.set(channels)
        gone = [number for number, each in self._subscriptions.items() if each.id not in channels]
        return self._close_subscriptions(gone)

    def set_services(self, services: Mapping[int, wire.Service]) -> None:
        """Replace the services that there are, by id, unless the client may not call."""
        if not self._refusal:
            self._services.set(services)

    def set_graph(self, graph: Connections) -> None:
        """Replace the graph."""
        self._graph = graph

    def set_clock(self, *, present: bool) -> None:
        """Note whether there is simulated time: from now on, all times are of that clock, or none."""
        if present is not bool(self._clocks % 2):
            self._clocks += 1
            self._is_info_due, self._time_ns = True, 0

    def set_time(self, time_ns: int) -> None:
        """Note what simulated time it is."""
        self._time_ns = time_ns

    def set_parameter(self, name: str, value: Mapping[str, Any]) -> None:
        """Note the value of a parameter that has changed, if the client watches it.

        Args:
            name: With its node's.
            value: For `messages.parameter_values`.
        """
        if (name in self._watched) is not self._watches_all:
            self._parameters.pop(name, None)
            self._parameters[name] = value
            if len(self._parameters) > MAX_PARAMETERS:
                del self._parameters[next(iter(self._parameters))]

    def add_message(self, subscription_id: int, message: M, size: int, source: bytes = b"") -> None:
        """Queue a message.

        Args:
            subscription_id: An open one.
            message: The message.
            size: Its bytes.
            source: The publisher if the topic is latched; else empty.
        """
        self._queue.add(subscription_id, message, size, source)

    def finish_call(self, answer: bytes, *, is_text: bool) -> None:
        """Queue the response of a call, or why there is none."""
        self._calls -= 1
        self.answers.add(answer, is_text=is_text)

    def finish_fetch(self, answer: bytes) -> None:
        """Queue a file, or why there is none."""
        self._fetches -= 1
        self.answers.add(answer, is_text=False)

    def report_drops(self) -> int:
        """Report the messages that were dropped since the last time; return how many there were."""
        drops = self._queue.drops
        count = drops.total()
        if count:
            self._dropped += count
            topics = [f"'{self._subscriptions[each].topic}'" for each, _ in drops.most_common(SHOWN_TOPICS)]
            more = f" and {len(drops) - SHOWN_TOPICS} other topics" if len(drops) > SHOWN_TOPICS else ""
            self.answers.report(
                wire.WARNING,
                f"This client reads too slowly: {count} messages of {', '.join(topics)}{more} were dropped, "
                f"{self._dropped} since it has connected",
                DROPS,
            )
            drops.clear()
        return count

    # To the client

    def next(self) -> Frame | Due[M] | None:
        """Return what to send next; None if there is nothing."""
        if self._is_info_due:
            return self._info()
        frame = self.answers.next()
        if frame is not None:
            return frame
        data = self._next_announcement() or self._next_parameters()
        if data:
            return Frame(data, is_text=True)
        if self._time_ns:
            time_ns, self._time_ns = self._time_ns, 0
            return Frame(wire.time(time_ns), is_text=False)
        if self._queue:
            number, message = self._queue.pop()
            return Due(number, self._subscriptions[number], message)
        return None

    def _info(self) -> Frame:
        self._is_info_due = False
        capabilities = [*CAPABILITIES, *(() if self._refusal else CONTROL_CAPABILITIES)]
        if self._clocks % 2:
            capabilities.append(TIME_CAPABILITY)
        session_id = f"{self._session_id}-{self._clocks}"
        encodings = () if self._refusal else ENCODINGS
        return Frame(wire.server_info(self._name, capabilities, encodings, session_id), is_text=True)

    def _next_announcement(self) -> bytes:
        if found := self._channels.next():
            gone, new = found
            return wire.unadvertise(gone) if gone else wire.advertise(new)
        if services := self._services.next():
            gone, added = services
            return wire.unadvertise_services(gone) if gone else wire.advertise_services(added)
        if self.watches_graph and self._graph is not self._known_graph:
            former, self._known_graph = self._known_graph, self._graph
            return _changes(former, self._graph)
        return b""

    def _next_parameters(self) -> bytes:
        some = [*islice(self._parameters, ITEMS_PER_FRAME)]
        return wire.parameter_values([self._parameters.pop(each) for each in some]) if some else b""


def _changes(former: Connections, now: Connections) -> bytes:
    """Return the text with the differences between two graphs; empty if there are none."""
    changed = [
        {name: nodes.get(name, ()) for name in {**before, **nodes} if nodes.get(name) != before.get(name)}
        for before, nodes in zip(former, now, strict=True)
    ]
    published, subscribed, served = changed
    topics = {**now.published, **now.subscribed}
    gone = [name for name in {**former.published, **former.subscribed} if name not in topics]
    unserved = [name for name in former.served if name not in now.served]
    for each in gone:
        published.pop(each, None)
        subscribed.pop(each, None)
    for each in unserved:
        del served[each]
    if not (published or subscribed or served or gone or unserved):
        return b""
    return wire.connection_graph_update(published, subscribed, served, gone, unserved)
