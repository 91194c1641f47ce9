"""`callboard bridge ros2`: one graph with the nodes of a ROS 2 network."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Final

from actors.cli.errors import OK, CommandError
from actors.cli.parsing import Options, Parser, add_broker_options

if TYPE_CHECKING:
    from actors.bridges.options import BridgeOptions
    from actors.bridges.ros2.importing import Ros

EXAMPLES: Final = {
    "callboard bridge ros2": "the network of ROS_DOMAIN_ID, until Ctrl-C",
    "callboard bridge ros2 --domain-id 7 --namespace /robot1": "its nodes and topics below /robot1",
    "callboard bridge ros2 --allow '/camera/**' --deny /camera/raw": "some topics and services only",
    "callboard bridge ros2 --check": "say which ROS 2 it would use, or what is missing",
}


def add_arguments(parser: Parser) -> None:
    """Describe the arguments."""
    parser.add_argument(
        "--domain-id", type=int, metavar="N", help="the domain of ROS 2; default: ROS_DOMAIN_ID, or 0"
    )
    parser.add_argument(
        "--allow", action="append", metavar="PATTERN",
        help="let only these topics, services and actions cross, such as '/camera/**'; may be repeated",
    )  # fmt: skip
    parser.add_argument(
        "--deny", action="append", metavar="PATTERN",
        help="let these not cross, also if they are allowed; may be repeated",
    )  # fmt: skip
    parser.add_argument(
        "--namespace", metavar="NAME",
        help="the namespace in callboard of the names of ROS 2, such as /robot1",
    )  # fmt: skip
    parser.add_argument(
        "--depth", action="append", metavar="PATTERN=N",
        help="the depth of the mirrors of topics, in messages, such as '/camera/**=2'; may be repeated",
    )  # fmt: skip
    parser.add_argument(
        "--config",
        metavar="FILE",
        help="a TOML file with these options and more; the command line takes precedence over it",
    )
    parser.add_flag("--check", help="say whether the options and ROS 2 can be used, and exit")
    add_broker_options(parser)


def run(options: Options) -> int:
    """Bridge until SIGINT or SIGTERM."""
    from actors.bridges.ros2.errors import RosNotFoundError
    from actors.bridges.ros2.importing import import_ros
    from actors.cli.loop import run_async
    from actors.cli.output import print_out
    from proto.aio import process

    chosen = _bridge_options(options)
    try:
        ros = import_ros()
    except RosNotFoundError as error:
        raise CommandError(str(error)) from None
    if options.check:
        print_out(f"ROS 2: {ros.distribution}, {ros.rmw}")
    else:
        run_async(lambda: _bridge(options, chosen, ros), loop_factory=process.new_event_loop)
    return OK


def _bridge_options(options: Options) -> BridgeOptions:
    from actors.bridges.options import load_options
    from actors.bridges.rules import parse_depth

    given = {
        "allow": options.allow and tuple(options.allow),
        "deny": options.deny and tuple(options.deny),
        "namespace": options.namespace,
        "depths": options.depth and tuple(map(parse_depth, options.depth)),
        "domain_id": options.domain_id,
    }
    chosen = {key: value for key, value in given.items() if value is not None}
    return load_options(chosen, None if options.config is None else Path(options.config))


async def _bridge(options: Options, chosen: BridgeOptions, ros: Ros) -> None:
    import json
    import secrets
    from functools import partial

    from actors.bridges.counters import Counters
    from actors.bridges.graph import BRIDGE_ID_LABEL, BRIDGE_LABEL
    from actors.bridges.ros2.bridge import Bridge
    from actors.bridges.ros2.errors import SuspendedError
    from actors.cli.broker_target import target_of
    from actors.cli.output import print_out
    from actors.config import environment
    from actors.interfaces.std_srvs.srv import Trigger
    from actors.logging.output import configure_logging
    from actors.logging.severity import LoggingSeverity
    from actors.node.node import Node
    from proto.aio import process

    if options.own_process:
        configure_logging(environment.log_level() or LoggingSeverity.INFO)
    target = target_of(options, knows_ros=True)
    domain = (environment.ros_domain_id(None) or 0) if chosen.domain_id is None else chosen.domain_id
    bridge_id = f"b{secrets.token_hex(4)}"  # names of ROS 2 begin with a letter
    network = f"ros2/{domain}"
    node = Node(
        f"ros2_bridge_{domain}_{bridge_id}",
        url=target.url,
        domain=target.domain,
        use_global_arguments=False,
        labels={BRIDGE_LABEL: network, BRIDGE_ID_LABEL: bridge_id},
        start_parameter_services=False,
        slow_callback_sec=None,  # the first message of a type makes its codecs
    )
    async with node:
        make = partial(Bridge, node, ros, chosen.rules, Counters(), bridge_id=bridge_id, domain_id=domain)
        bridge = make(lease_sec=chosen.lease_sec)

        def report(_: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
            response.success, response.message = True, json.dumps(bridge.document())
            return response

        node.create_service(Trigger, "~/get_report", report)
        process.configure_process()
        print_out(f"callboard bridge between {target.url} domain {target.domain} and ROS 2 domain {domain}")
        while True:
            try:
                await bridge.run()
            except SuspendedError as error:
                node.get_logger().warning(str(error))
                bridge = make(lease_sec=chosen.lease_sec)
