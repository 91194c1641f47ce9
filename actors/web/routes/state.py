"""What handlers find in the application."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Final

from aiohttp import web

if TYPE_CHECKING:
    from actors.tools.graph_types import GraphTypes
    from actors.web.assets import Assets
    from actors.web.calls import Calls
    from actors.web.goals import Goals
    from actors.web.live.panels import Panels
    from actors.web.metrics import Metrics
    from actors.web.observer import Observer
    from actors.web.options import WebOptions
    from actors.web.probes import RoundTrips
    from actors.web.security import Door
    from actors.web.topic_feed import TopicFeeds


@dataclass(kw_only=True, slots=True)
class State:
    """What handlers share.

    Attributes:
        options: What the server was told.
        door: Who may ask for what.
        observer: Watches the graph.
        feeds: Read topics.
        panels: Make the panels of pages.
        assets: The page's files.
        types: The graph's classes.
        calls: Calls services and publishes.
        goals: The goals that were sent.
        metrics: For operators.
        round_trips: Measures them for the metrics.
        live: How many browsers and streams are connected now.
        sockets: Those of the browsers, for the stop.
    """

    options: WebOptions
    door: Door
    observer: Observer
    feeds: TopicFeeds
    panels: Panels
    assets: Assets
    types: GraphTypes
    calls: Calls
    goals: Goals
    metrics: Metrics
    round_trips: RoundTrips
    live: int = 0
    sockets: set[web.WebSocketResponse[bool]] = field(default_factory=set[web.WebSocketResponse[bool]])


STATE: Final = web.AppKey("STATE", State)


def state_of(request: web.Request) -> State:
    """Return what handlers share."""
    return request.app[STATE]
