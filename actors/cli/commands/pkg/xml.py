"""`callboard pkg xml`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from actors.cli.commands.pkg import require_package
from actors.cli.parsing import Options, Parser, add_json_option

if TYPE_CHECKING:
    from xml.etree.ElementTree import Element

EXAMPLES: Final = {
    "callboard pkg xml my_package": "the package.xml of a package of ROS 2",
    "callboard pkg xml my_package --tag version": "what one of its tags says",
}


def add_arguments(parser: Parser) -> None:
    """Describe the arguments."""
    parser.add_argument("package", metavar="PACKAGE", help="its name")
    parser.add_argument(
        "-t", "--tag", metavar="TAG", help="only the texts of this tag, such as version or export/build_type"
    )
    add_json_option(parser, "an object with package, and xml, or with --tag texts")


def run(options: Options) -> int:
    """Print a package's manifest, or the texts of one of its tags."""
    from xml.etree.ElementTree import tostring

    from actors.cli.errors import CommandError
    from actors.cli.output import print_json, print_names, print_out

    root = _manifest(options.package)
    if options.tag is None:
        xml = tostring(root, encoding="unicode")
        if options.json:
            print_json({"package": options.package, "xml": xml})
        else:
            print_out(xml)
        return 0
    found = [root]
    for name in options.tag.split("/"):
        found = [child for each in found for child in each if child.tag == name]
    texts = [each.text or "" for each in found]
    if not texts:
        raise CommandError("XML tag not found")
    if options.json:
        print_json({"package": options.package, "texts": texts})
    else:
        print_names(texts)
    return 0


def _manifest(name: str) -> Element:
    """Return the root of a package's package.xml.

    Raises:
        CommandError: There is no such package, or it has none, or not one of XML.
    """
    from xml.etree.ElementTree import ParseError, fromstring

    from actors.cli.errors import CommandError
    from actors.regular_files import read_regular_text

    share = require_package(name, "Package not found").ros_share()
    if share is None:
        raise CommandError(
            f"Package XML manifest not found: '{name}' is no package of ROS 2; pip show {name} describes it"
        )
    file = share / "package.xml"
    try:
        return fromstring(read_regular_text(file))  # noqa: S314 - an installed package may do worse
    except (ParseError, UnicodeDecodeError) as error:
        raise CommandError(f"{file} is not XML: {error}") from None
