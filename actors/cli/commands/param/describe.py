"""`callboard param describe`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from actors.cli.parameters import run_with_client
from actors.cli.parsing import Options, Parser, add_json_option
from actors.cli.remote_node import add_node_argument, add_remote_options

if TYPE_CHECKING:
    from actors.parameter_client.client import ParameterClient
    from actors.parameters.types import FloatingPointRange, IntegerRange, ParameterDescriptor

EXAMPLES: Final = {"callboard param describe /driver speed": "its type, description and constraints"}


def add_arguments(parser: Parser) -> None:
    """Describe the arguments."""
    add_node_argument(parser)
    parser.add_argument("parameters", metavar="NAME", nargs="+", help="names of parameters")
    add_json_option(
        parser,
        "one array: name, type, description, additional_constraints, read_only, dynamic_typing, range",
    )
    add_remote_options(parser)


def run(options: Options) -> int:
    """Print what the node says about parameters."""
    return run_with_client(options, lambda client: _describe(options, client))


async def _describe(options: Options, client: ParameterClient) -> int:
    from actors.cli.output import print_err, print_json
    from actors.tools import node_documents

    found = await client.describe_parameters(options.parameters)
    known = [each for each in found if each.name]
    if options.json:
        print_json([node_documents.descriptor(each) for each in known])
    else:
        for each in known:
            _print(each)
    for name, each in zip(options.parameters, found, strict=True):
        if not each.name:
            print_err(f"Parameter not declared: {name}")
    return int(len(known) < len(found))


def _range(descriptor: ParameterDescriptor) -> FloatingPointRange | IntegerRange | None:
    return next(iter(descriptor.floating_point_range), None) or next(iter(descriptor.integer_range), None)


def _print(descriptor: ParameterDescriptor) -> None:
    from actors.cli.output import print_out
    from actors.tools.node_documents import PARAMETER_TYPES

    print_out(f"Parameter name: {descriptor.name}".replace("\n", "\\n"))  # it may be any text
    print_out(f"  Type: {PARAMETER_TYPES[descriptor.type]}")
    if descriptor.description:
        print_out(f"  Description: {descriptor.description}")
    print_out("  Constraints:")
    if descriptor.read_only:
        print_out("    Read only: true")
    limits = _range(descriptor)
    if limits is not None:
        print_out(f"    Min value: {limits.from_value}\n    Max value: {limits.to_value}")
        if limits.step:
            print_out(f"    Step: {limits.step}")
    if descriptor.additional_constraints:
        print_out(f"    Additional constraints: {descriptor.additional_constraints}")
