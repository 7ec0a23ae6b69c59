"""The verbs of `ros2 interface`, which read files and do not join a graph."""

from __future__ import annotations

import sys
from typing import Any

from autograder.ros2 import interfaces, messages
from autograder.ros2.failure import Failure
from autograder.ros2.session import Session

_HEADINGS = {"msg": "Messages", "srv": "Services", "action": "Actions"}
_SEPARATOR = "---"


def add_verbs(verbs: Any) -> None:
    """Add the verbs of `ros2 interface` to the parser."""
    parser = verbs.add_parser("show", help="Output the interface definition")
    comments = parser.add_mutually_exclusive_group()
    comments.add_argument("--all-comments", action="store_true", help="Show all comments, nested ones too")
    comments.add_argument("--no-comments", action="store_true", help="Show no comments or whitespace")
    parser.add_argument("type", help="Such as 'std_msgs/msg/String'; '-' reads it from standard input")
    parser.set_defaults(run=_show)
    parser = verbs.add_parser("proto", help="Output an interface prototype")
    parser.add_argument("type", help="Such as 'std_msgs/msg/String'")
    parser.add_argument("--no-quotes", action="store_true", help="Without the outer quotes")
    parser.set_defaults(run=_proto)
    parser = verbs.add_parser("package", help="Output a list of available interface types within one package")
    parser.add_argument("package_name", help="Name of the ROS package (e.g. 'std_msgs')")
    _kinds(parser)
    parser.set_defaults(run=_package)
    parser = verbs.add_parser("packages", help="Output a list of packages that provide interfaces")
    _kinds(parser)
    parser.set_defaults(run=_packages)
    parser = verbs.add_parser("list", help="List all interface types available")
    _kinds(parser)
    parser.set_defaults(run=_list)


def _kinds(parser: Any) -> None:
    parser.add_argument("-m", "--only-msgs", dest="msg", action="store_true", help="Only the message types")
    parser.add_argument("-s", "--only-srvs", dest="srv", action="store_true", help="Only the service types")
    parser.add_argument("-a", "--only-actions", dest="action", action="store_true", help="Only the action types")


def _chosen(options: Any) -> list[str]:
    kinds = [kind for kind in interfaces.KINDS if getattr(options, kind)]
    return kinds or list(interfaces.KINDS)


def _show(_: Session, options: Any) -> None:
    name = options.type if options.type != "-" else sys.stdin.readline().strip()
    try:
        _print(name, options.all_comments or not options.no_comments, options.all_comments, "")
    except LookupError as error:
        raise Failure(str(error.args[0])) from None


def _print(name: str, comments: bool, nested_comments: bool, indent: str) -> None:
    from rosidl_adapter.parser import parse_message_string

    package, _, own = [*name.split("/"), "", ""][:3]
    for line in interfaces.source_of(name).splitlines():
        text = line.rstrip()
        parsed = None if text == _SEPARATOR else parse_message_string(package, own, text)
        field = parsed.fields[0] if parsed and parsed.fields else None
        shown = text
        if not comments and parsed:
            if not text or parsed.annotations["comment"]:
                continue
            if field and field.annotations["comment"]:
                # If a comment follows a field, only the text of the comment is left out, as in the real tool.
                shown = text[: text.find(field.annotations["comment"][0]) - 1].strip()
        print(f"{indent}{shown}" if shown else "")
        kind = str(field.type).partition("[")[0] if field else ""
        if "/" in kind:
            _print(kind.replace("/", "/msg/"), nested_comments, nested_comments, indent + "\t")


def _proto(_: Session, options: Any) -> None:
    try:
        found = interfaces.interface(options.type)
    except LookupError:
        raise Failure(f"The passed interface type is invalid: '{options.type}'") from None
    kind = options.type.split("/")[1]
    made = {"msg": lambda: found(), "srv": lambda: found.Request(), "action": lambda: found.Goal()}[kind]()
    text = messages.to_yaml(made)
    print(text if options.no_quotes else f'"{text}"')


def _package(_: Session, options: Any) -> None:
    found = interfaces.packages().get(options.package_name)
    if found is None:
        raise Failure(f"Unknown package '{options.package_name}'")
    for name in found:
        if name.split("/")[0] in _chosen(options):
            print(f"{options.package_name}/{name}")


def _packages(_: Session, options: Any) -> None:
    for package, names in sorted(interfaces.packages().items()):
        if any(name.split("/")[0] in _chosen(options) for name in names):
            print(package)


def _list(_: Session, options: Any) -> None:
    found = sorted(interfaces.packages().items())
    for kind in _chosen(options):
        print(f"{_HEADINGS[kind]}:")
        for package, names in found:
            for name in sorted(names):
                if name.startswith(f"{kind}/"):
                    print(f"    {package}/{name}")
