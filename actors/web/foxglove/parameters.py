"""Parameters of all nodes under one name each: the node's name, a dot, and the parameter's.

Foxglove's bridge for ROS 2 names them so. A node's name has no dot; a parameter's may have some.
"""

from __future__ import annotations

import asyncio
import base64
from typing import TYPE_CHECKING, Any, Final, cast

import msgspec

from actors.interfaces.codec import codec_for
from actors.interfaces.errors import InvalidMessageError
from actors.interfaces.rcl_interfaces.msg import ParameterEvent
from actors.node.parameter_services import EVENTS_TOPIC
from actors.parameters.types import Parameter, ParameterType, parameter_value_to_python
from actors.web.node_watch import MAX_PARAMETERS, NODE_ANSWER_SEC
from actors.web.parameter_nodes import nodes_in
from actors.web.parameter_values import InvalidValueError, parameter_from_json
from actors.web.subscription_answer import SubscriptionRefusedError
from proto.aio.tasks import keep_running
from proto.errors import CallboardError
from proto.untrusted_text import escape

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping, Sequence

    from actors.interfaces.rcl_interfaces.msg import Parameter as ParameterMessage
    from actors.web.foxglove.messages import ParameterItem
    from actors.web.observer import Observer
    from actors.web.parameter_nodes import ParameterNodes
    from actors.web.topic_feed import TopicFeeds, TopicReader

MAX_EVENTS: Final = 1000
"""Changes that wait until they are looked at; if more come, all parameters are read again."""

SHOWN_NODES: Final = 3
"""Nodes that are named when a client asks for parameters of some that do not exist."""

BYTES, DOUBLE, DOUBLES = "byte_array", "float64", "float64_array"
"""Types that a value in JSON does not show."""


class Parameters:
    """The parameters of one user's graph.

    Args:
        observer: Has the graph.
        nodes: The nodes that are asked.
        feeds: Read topics.
        changed: Called with the name and the new value of each parameter that has changed.
    """

    def __init__(
        self,
        observer: Observer,
        nodes: ParameterNodes,
        feeds: TopicFeeds,
        changed: Callable[[str, Mapping[str, Any]], None],
    ) -> None:
        self._observer, self._nodes, self._feeds, self._changed = observer, nodes, feeds, changed
        self._events: TopicReader | None = None
        self._news = asyncio.Event()
        self._task: asyncio.Task[None] | None = None

    async def get(self, names: Sequence[str], problems: list[str]) -> list[dict[str, Any]]:
        """Return the values of parameters.

        Args:
            names: Of the parameters with their nodes'; empty for all of all nodes.
            problems: Gets the reasons why some are missing.
        """
        wanted: dict[str, dict[str, None]] = {}
        if not names:
            wanted = {each: {} for each in sorted(nodes_in(self._observer.snapshot))}
        for name in names:
            node, _, parameter = name.partition(".")
            wanted.setdefault(node, {})[parameter] = None  # each once
        await self._leave_out_missing(wanted, problems)
        found = await asyncio.gather(*(self._get(node, [*some], problems) for node, some in wanted.items()))
        return [each for some in found for each in some]

    async def set(self, items: Sequence[ParameterItem], problems: list[str]) -> None:
        """Set parameters.

        Args:
            items: Each is set, or not, by itself.
            problems: Gets the reasons why some are not.
        """
        wanted: dict[str, list[ParameterItem]] = {}
        for each in items:
            wanted.setdefault(each.name.partition(".")[0], []).append(each)
        await self._leave_out_missing(wanted, problems)
        await asyncio.gather(*(self._set(node, some, problems) for node, some in wanted.items()))

    async def watch(self) -> None:
        """Report changes from now on; nothing if that has begun.

        Raises:
            TooManyTopicsError: No more topics can be read.
            SubscriptionRefusedError: The user may not read the topic of changes.
        """
        if self._events is None:
            self._events = self._feeds.read(EVENTS_TOPIC, MAX_EVENTS, self._news.set)
        events = self._events
        try:
            await events.accepted()
        except SubscriptionRefusedError:
            if self._events is events:
                self.close()
            raise
        if self._task is None and self._events is events:  # `close` and other clients come between
            watch = keep_running("The watch of parameters", self._follow)
            self._task = asyncio.get_running_loop().create_task(watch)

    def close(self) -> None:
        """Report no more changes."""
        if self._task is not None:
            self._task.cancel()
        if self._events is not None:
            self._events.close()
        self._task = self._events = None

    async def _leave_out_missing(self, wanted: dict[str, Any], problems: list[str]) -> None:
        """Remove the nodes that do not serve their parameters: a task for each would keep the loop busy."""
        if missing := sorted(await self._nodes.missing(wanted)):
            for each in missing:
                del wanted[each]
            shown = ", ".join(f"'{escape(each)}'" for each in missing[:SHOWN_NODES])
            more = f" and {len(missing) - SHOWN_NODES} more" if len(missing) > SHOWN_NODES else ""
            problems.append(f"These nodes do not serve parameters now: {shown}{more}")

    async def _get(self, node: str, names: list[str], problems: list[str]) -> list[dict[str, Any]]:
        try:
            async with self._nodes.client(node) as client:
                if not names:
                    every = (await client.list_parameters((), 0, NODE_ANSWER_SEC)).names
                    names = sorted(every)[:MAX_PARAMETERS]
                values = await client.get_parameters(names, NODE_ANSWER_SEC)
        except CallboardError as error:
            problems.append(f"Parameters of '{escape(node)}': {error}")
            return []
        return [value_of(f"{node}.{each.name}", each) for each in values]

    async def _set(self, node: str, items: list[ParameterItem], problems: list[str]) -> None:
        try:
            async with self._nodes.client(node) as client:
                names = [each.name.partition(".")[2] for each in items]
                types = await client.get_parameter_types(names, NODE_ANSWER_SEC)
                wanted = list[Parameter]()
                for item, name, kind in zip(items, names, types, strict=True):
                    try:
                        wanted.append(parameter_of(item, name, kind))
                    except InvalidValueError as error:
                        problems.append(str(error))
                results = await client.set_parameters(wanted, NODE_ANSWER_SEC)
        except CallboardError as error:
            problems.append(f"Parameters of '{escape(node)}': {error}")
            return
        for parameter, result in zip(wanted, results, strict=True):
            if not result.successful:
                problems.append(
                    f"'{escape(node)}.{escape(parameter.name)}': {result.reason or 'it is refused'}"
                )

    async def _follow(self) -> None:
        while self._events is not None:
            await self._news.wait()
            self._news.clear()
            events = self._events
            received = events.pop()
            skipped, events.skipped = events.skipped, 0
            if skipped:
                changes = [(each["name"], each) for each in await self.get([], [])]
            else:
                data = [each.data for each in received]
                changes = await self._observer.work.run(_changes_in, data)
            for name, value in changes:
                self._changed(name, value)


def value_of(name: str, parameter: Parameter) -> dict[str, Any]:
    """Return a parameter for `messages.parameter_values`.

    Args:
        name: Its name with the node's.
        parameter: The parameter.
    """
    kind, value = parameter.type_, parameter.value
    if value is None:
        return {"name": name}
    if kind is ParameterType.DOUBLE:
        return {"name": name, "value": value, "type": DOUBLE}
    if kind is ParameterType.DOUBLE_ARRAY:
        return {"name": name, "value": [*_items(value)], "type": DOUBLES}
    if kind is ParameterType.BYTE_ARRAY:
        data = value if isinstance(value, bytes) else b"".join(_items(value))
        return {"name": name, "value": base64.b64encode(data).decode(), "type": BYTES}
    return {"name": name, "value": value if isinstance(value, bool | int | str) else [*_items(value)]}


def _items(value: object) -> Iterable[Any]:
    return cast("Iterable[Any]", value)


def parameter_of(item: ParameterItem, name: str, kind: ParameterType) -> Parameter:
    """Return a parameter to set.

    Args:
        item: From a client.
        name: The parameter's, without the node's.
        kind: The type that it has now: JavaScript makes the integer 3 of 3.0.

    Raises:
        InvalidValueError: No parameter can have the value.
    """
    value = item.value
    if value is msgspec.UNSET:
        return Parameter(name)
    if value is None:
        raise InvalidValueError(f"'{escape(item.name)}': null is no value; leave out `value` to unset it")
    if item.type == BYTES:
        try:
            return Parameter(name, ParameterType.BYTE_ARRAY, base64.b64decode(value, validate=True))
        except (TypeError, ValueError):
            raise InvalidValueError(f"'{escape(item.name)}': the bytes are not base64") from None
    stated = {DOUBLE: ParameterType.DOUBLE, DOUBLES: ParameterType.DOUBLE_ARRAY}.get(item.type or "")
    if stated is not None:
        return parameter_from_json(name, stated, value)
    try:
        return parameter_from_json(name, kind or None, value)
    except InvalidValueError:
        return parameter_from_json(name, None, value)  # the node decides whether its type may change


def _changes_in(events: Iterable[bytes]) -> list[tuple[str, dict[str, Any]]]:
    """Return the names and values of the parameters that some messages of `/parameter_events` are about."""
    decode = codec_for(ParameterEvent).decode
    changes = list[tuple[str, dict[str, Any]]]()
    for data in events:
        try:
            event = decode(data)
        except InvalidMessageError:
            continue
        for each in (*event.new_parameters, *event.changed_parameters):
            name = f"{event.node}.{each.name}"
            parameter = _parameter(each)
            if parameter is not None:
                changes.append((name, value_of(name, parameter)))
        for each in event.deleted_parameters:
            name = f"{event.node}.{each.name}"
            changes.append((name, {"name": name}))
    return changes


def _parameter(found: ParameterMessage) -> Parameter | None:
    try:
        kind = ParameterType(found.value.type)
        return Parameter(found.name, kind, parameter_value_to_python(found.value))
    except (TypeError, ValueError):
        return None  # of a type that there is not
