"""Nodes without a process of their own: any number of them on the link of a node that runs."""

from __future__ import annotations

from typing import TYPE_CHECKING

from actors.arguments.remapping import Remapper
from actors.callbacks.must_await import must_await
from actors.endpoints.bare_context import BareContext
from actors.node.node_endpoints import NodeEndpoints
from actors.time.timeout import DEFAULT_TIMEOUT
from proto.wire.labels import check_label_text, check_labels

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from actors.endpoints.context import NodeContext
    from actors.time.timeout import Timeout


class BareNode(NodeEndpoints):
    """A node of its own in the graph, with endpoints and nothing else. Made by `Node.create_bare_node`."""

    def __init__(
        self,
        owner: NodeContext,
        node_name: str,
        namespace: str,
        *,
        labels: Mapping[str, str],
        apart: str,
        shared_name: bool,
        yields_name: bool,
        on_refused: Callable[[str], object] | None,
    ) -> None:
        self._names = Remapper(node_name, namespace)
        check_labels(labels)
        check_label_text("apart", apart)
        self._bare = BareContext(
            owner,
            name=node_name,
            namespace=namespace,
            labels=labels,
            apart=apart,
            shared_name=shared_name,
            yields_name=yields_name,
            on_refused=on_refused,
        )
        self._context = self._bare

    @property
    def labels(self) -> Mapping[str, str]:
        """Its labels: strings by name."""
        return dict(self._bare.labels)

    @property
    def apart(self) -> str:
        """Its endpoints match none of nodes with the same text, unless it is empty."""
        return self._bare.apart

    @property
    def refusal(self) -> str:
        """Why the broker of this session has refused it; "" if it has not, or not yet.

        Its endpoints have the same refusal then.
        """
        return self._context.refusal

    @property
    def name_taken(self) -> bool:
        """Whether the broker of this session has refused it because another node has its name."""
        return self._bare.name_taken

    @property
    def destroyed(self) -> bool:
        """Whether it has been destroyed, by itself or with the node that it belongs to."""
        return self._context.destroyed

    @must_await
    async def wait_until_accepted(self, timeout_sec: Timeout = DEFAULT_TIMEOUT) -> bool:
        """Wait until a broker has accepted or refused it.

        Args:
            timeout_sec: Seconds to wait at most; None for no limit.

        Returns:
            True if it is in the graph; False if the broker has refused it: `refusal` says why.

        Raises:
            WaitTimeout: No broker has answered within `timeout_sec`.
            RuntimeError: The node that it belongs to does not run.
            NodeDestroyed: It has been destroyed.
        """
        context = self._context
        failure = f"The broker has not answered for the node '{context.full_name}'"
        await context.wait_until(lambda: context.declared, failure, timeout_sec)
        return not context.refusal

    def destroy(self) -> None:
        """Take it and everything it has out of service, after what it has published has been sent.

        Its name is free then, usually at once. A second call does nothing.
        """
        self._bare.destroy()
