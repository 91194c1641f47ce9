"""Subscriptions that receive only some of their messages, as a function of the program decides."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from actors.endpoints.endpoint import endpoint_of
from actors.endpoints.subscription.decoding import SelectingDecoder

if TYPE_CHECKING:
    from collections.abc import Callable

    from actors.endpoints.subscription.subscription import Subscription


def select(subscription: Subscription[Any], wants: Callable[[Any], bool] | None) -> None:
    """Let a subscription receive only some of the messages that arrive from now on. In the loop's thread.

    Args:
        subscription: The subscription. Its publishers and broker keep their depths with all messages.
        wants: Returns whether a message (bytes, if it is raw) is received; it must be quick, and not raise.
            None for all messages.
    """
    endpoint = endpoint_of(subscription)
    decoder = endpoint.decoder
    if isinstance(decoder, SelectingDecoder):
        decoder = decoder.decoder
    endpoint.decoder = decoder if wants is None else SelectingDecoder(decoder, wants)
