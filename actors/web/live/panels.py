"""The panels by their names."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, TypeVar

import msgspec

from actors.tools import graph_documents
from actors.web.live.broker_panel import BrokerPanel
from actors.web.live.delay_panel import DelayPanel, DelayParameters
from actors.web.live.echo_panel import EchoPanel, EchoParameters
from actors.web.live.entry_panel import EntryPanel
from actors.web.live.graph_panel import GraphPanel, GraphParameters
from actors.web.live.log_panel import LogPanel
from actors.web.live.node_panel import NodePanel
from actors.web.live.overview_panel import OverviewPanel
from actors.web.live.panel import PanelError
from actors.web.live.plot_panel import PlotPanel, PlotParameters
from actors.web.live.topic_panel import TopicPanel
from actors.web.log_reader import LogFilter, LogReaders
from actors.web.node_watch import NodeWatches

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from actors.web.live.panel import Panel
    from actors.web.observer import Observer
    from actors.web.topic_feed import TopicFeeds

T = TypeVar("T")


class TopicParameters(msgspec.Struct, forbid_unknown_fields=True):
    """Parameters of a panel for one topic.

    Attributes:
        topic: Its full name.
    """

    topic: str


class NodeParameters(msgspec.Struct, forbid_unknown_fields=True):
    """Parameters of a panel for one node.

    Attributes:
        node: Its full name.
    """

    node: str


class NameParameters(msgspec.Struct, forbid_unknown_fields=True):
    """Parameters of a panel for one service or action.

    Attributes:
        name: Its full name.
    """

    name: str


class NoParameters(msgspec.Struct, forbid_unknown_fields=True):
    """A panel without parameters."""


class Panels:
    """Makes panels for one graph.

    Args:
        observer: Watches the graph.
        feeds: Read its topics.

    Attributes:
        logs: Read its log.
    """

    def __init__(self, observer: Observer, feeds: TopicFeeds) -> None:
        self._observer = observer
        self._feeds = feeds
        self._nodes = NodeWatches(observer, feeds)
        self.logs = LogReaders(observer)
        self._makers: dict[str, Callable[[Mapping[str, Any], Callable[[], None]], Panel]] = {
            "broker": self._broker,
            "overview": self._overview,
            "graph": self._graph,
            "topic": self._topic,
            "echo": self._echo,
            "delays": self._delays,
            "plot": self._plot,
            "node": self._node,
            "log": self._log,
            "service": self._service,
            "action": self._action,
        }

    def make(self, name: str, parameters: Mapping[str, Any], wake: Callable[[], None]) -> Panel:
        """Return a new panel.

        Args:
            name: Which.
            parameters: The panel's parameters, as the page has sent them.
            wake: Called when the panel has something new.

        Raises:
            PanelError: There is no such panel.
            msgspec.ValidationError: Parameters are missing, unknown or of other types.
            CallboardError: It cannot show what it should.
        """
        maker = self._makers.get(name)
        if maker is None:
            raise PanelError(f"There is no panel {name!r}; there is {', '.join(self._makers)}")
        return maker(parameters, wake)

    def _broker(self, parameters: Mapping[str, Any], wake: Callable[[], None]) -> Panel:
        _converted(parameters, NoParameters)
        return BrokerPanel(self._observer, wake)

    def _overview(self, parameters: Mapping[str, Any], wake: Callable[[], None]) -> Panel:
        _converted(parameters, NoParameters)
        return OverviewPanel(self._observer, wake)

    def _graph(self, parameters: Mapping[str, Any], wake: Callable[[], None]) -> Panel:
        return GraphPanel(self._observer, _converted(parameters, GraphParameters), wake)

    def _echo(self, parameters: Mapping[str, Any], wake: Callable[[], None]) -> Panel:
        return EchoPanel(self._feeds, _converted(parameters, EchoParameters), wake)

    def _delays(self, parameters: Mapping[str, Any], wake: Callable[[], None]) -> Panel:
        return DelayPanel(self._observer, self._feeds, _converted(parameters, DelayParameters), wake)

    def _topic(self, parameters: Mapping[str, Any], wake: Callable[[], None]) -> Panel:
        return TopicPanel(self._observer, _converted(parameters, TopicParameters).topic, wake)

    def _plot(self, parameters: Mapping[str, Any], wake: Callable[[], None]) -> Panel:
        return PlotPanel(self._feeds, _converted(parameters, PlotParameters), wake)

    def _node(self, parameters: Mapping[str, Any], wake: Callable[[], None]) -> Panel:
        return NodePanel(self._observer, self._nodes, _converted(parameters, NodeParameters).node, wake)

    def _log(self, parameters: Mapping[str, Any], wake: Callable[[], None]) -> Panel:
        return LogPanel(self.logs, _converted(parameters, LogFilter), wake)

    def _service(self, parameters: Mapping[str, Any], wake: Callable[[], None]) -> Panel:
        name = _converted(parameters, NameParameters).name
        return EntryPanel(self._observer, graph_documents.service, name, wake)

    def _action(self, parameters: Mapping[str, Any], wake: Callable[[], None]) -> Panel:
        name = _converted(parameters, NameParameters).name
        return EntryPanel(self._observer, graph_documents.action, name, wake)


def _converted(parameters: Mapping[str, Any], kind: type[T]) -> T:
    return msgspec.convert(dict(parameters), kind)
