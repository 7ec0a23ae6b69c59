"""The verbs of `ros2 service`."""

from __future__ import annotations

from typing import Any

import yaml

from autograder.ros2 import messages
from autograder.ros2.failure import Failure
from autograder.ros2.interfaces import interface
from autograder.ros2.options import above_zero, add_graph_options, values, yaml_text
from autograder.ros2.session import Session


def add_verbs(verbs: Any) -> None:
    """Add the verbs of `ros2 service` to the parser."""
    parser = add_graph_options(verbs.add_parser("list", help="Output a list of available services"))
    parser.add_argument("-t", "--show-types", action="store_true", help="Additionally show the service type")
    parser.add_argument("-c", "--count-services", action="store_true", help="Only display the number of services")
    _hidden(parser)
    parser.set_defaults(run=_list)
    parser = add_graph_options(verbs.add_parser("type", help="Output a service's type"))
    parser.add_argument("service_name", help="Name of the ROS service to get type (e.g. '/talker/list_parameters')")
    _hidden(parser)
    parser.set_defaults(run=_type)
    parser = add_graph_options(verbs.add_parser("info", help="Print information about a service"))
    parser.add_argument("service_name", help="Name of the ROS service to get info (e.g. '/add_two_ints')")
    parser.set_defaults(run=_info)
    parser = add_graph_options(verbs.add_parser("find", help="Output a list of services of a given type"))
    parser.add_argument("service_type", help="Name of the ROS service type to filter for")
    parser.add_argument("-c", "--count-services", action="store_true", help="Only display the number of services")
    _hidden(parser)
    parser.set_defaults(run=_find)
    parser = add_graph_options(verbs.add_parser("call", help="Call a service"))
    parser.add_argument("service_name", help="Name of the ROS service to call to (e.g. '/add_two_ints')")
    parser.add_argument("service_type", help="Type of the ROS service (e.g. 'std_srvs/srv/Empty')")
    values(parser, "values", "Values in YAML format (e.g. '{a: 1, b: 2}')")
    parser.add_argument("-r", "--rate", metavar="N", type=above_zero, help="Repeat the call at a specific rate in Hz")
    parser.set_defaults(run=_call)


def _hidden(parser: Any) -> None:
    parser.add_argument("--include-hidden-services", action="store_true", help="Consider hidden services as well")


def _list(session: Session, options: Any) -> None:
    services = session.services(options.include_hidden_services)
    if options.count_services:
        print(len(services))
    elif services:
        lines = [f"{name} [{', '.join(types)}]" if options.show_types else name for name, types in services]
        print(*lines, sep="\n")


def _type(session: Session, options: Any) -> None:
    services = options.include_hidden_services
    types = session.look_for(lambda: dict(session.services(services)).get(options.service_name))
    if types is None:
        raise Failure("")
    print(*types, sep="\n")


def _info(session: Session, options: Any) -> None:
    name = options.service_name
    types = session.look_for(lambda: dict(session.services(hidden=True)).get(name))
    if types is None:
        raise Failure(f"Unknown service '{name}'")
    print(f"Type: {types[0] if len(types) == 1 else types}")
    print(f"Clients count: {session.graph.count_clients(name)}")
    print(f"Services count: {session.graph.count_services(name)}")


def _find(session: Session, options: Any) -> None:
    services = session.services(options.include_hidden_services)
    names = [name for name, types in services if options.service_type in types]
    if options.count_services:
        print(len(names))
    elif names:
        print(*names, sep="\n")


def _call(session: Session, options: Any) -> None:
    try:
        service_type = interface(options.service_type, "srv")
    except LookupError:
        raise Failure("The passed service type is invalid") from None
    request = service_type.Request()
    try:
        messages.fill(request, yaml.safe_load(yaml_text(options, "values")))
    except Exception as error:
        raise Failure(f"Failed to populate field: {error}") from None
    _ = session.graph  # "waiting" is printed only if the server is missing, not because it is not discovered yet
    client = session.node.create_client(service_type, options.service_name)
    if not client.service_is_ready():
        if not session.spin_until(client.service_is_ready, 0.1):
            print("waiting for service to become available...", flush=True)
        session.spin_until(client.service_is_ready)
    while True:
        print(f"requester: making request: {request!r}\n", flush=True)
        print(f"response:\n{session.answer(client.call_async(request))!r}\n", flush=True)
        if not options.rate:
            return
        session.spin_until(lambda: False, 1 / options.rate)
