"""The service `~/get_type_description`: the definitions of the types that a node uses, by type hash."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

from actors.endpoints.service.idle import IdleService
from actors.interfaces.convert import message_from_fields
from actors.interfaces.described import texts_of
from actors.interfaces.message import definition, type_hash
from actors.interfaces.type_description_interfaces.msg import TypeDescription, TypeSource
from actors.interfaces.type_description_interfaces.srv import GetTypeDescription
from proto.errors import InvalidServiceNameError

if TYPE_CHECKING:
    from actors.arguments.remapping import Remapper
    from actors.endpoints.context import NodeContext


class TypeDescriptionService:
    """The service of one node.

    Args:
        context: The node.
        names: Expands and remaps the service's name.
    """

    def __init__(self, context: NodeContext, names: Remapper) -> None:
        self._context = context
        try:
            full_name = names.resolve_service("~/get_type_description")
        except InvalidServiceNameError as error:
            context.log.warning(f"The node's name is too long for its type description service: {error}")
            return
        IdleService(context, GetTypeDescription, full_name, callback=self._answer, concurrent=True)

    def _answer(self, request: GetTypeDescription.Request) -> GetTypeDescription.Response:
        # Only types in use, as in ROS 2: the service is no catalogue of everything that is installed.
        in_use = {each.interface for each in self._context.endpoints} - {None}
        found = next((each for each in in_use if type_hash(each) == request.type_hash), None)
        if found is None:
            return GetTypeDescription.Response(failure_reason="Type not currently in use by this node")
        described = definition(found)
        return GetTypeDescription.Response(
            successful=True,
            type_description=message_from_fields(TypeDescription, json.loads(described)),
            type_sources=_sources(described) if request.include_type_sources else [],
        )


def _sources(described: bytes) -> list[TypeSource]:
    """Return the text of the type and of each that it uses; a type that ROS derives from another has none."""
    sources: list[TypeSource] = []
    for name, text in texts_of(described).items():
        _, kind, word = name.split("/")
        derived = "_" in word
        sources.append(
            TypeSource(
                type_name=name,
                encoding="implicit" if derived else kind,
                raw_file_contents="" if derived else text,
            )
        )
    return sources
