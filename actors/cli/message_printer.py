"""Print messages in the format that a command's options choose."""

from __future__ import annotations

import base64
import sys
from typing import TYPE_CHECKING, Any, Final, cast

from actors.cli.errors import USAGE, CommandError
from actors.cli.output import print_err, print_json, print_out
from actors.interfaces.convert import message_to_csv, message_to_ordereddict, message_to_yaml
from actors.interfaces.errors import InvalidMessageError
from actors.interfaces.message import Message
from actors.tools.field_paths import InvalidFieldError, require_path, value_at
from actors.tools.message_filter import InvalidFilterError, MessageFilter
from proto.untrusted_text import peer_text

if TYPE_CHECKING:
    import argparse
    from collections.abc import Callable

    from actors.endpoints.subscription.backlog import MessageInfo


CLEAR: Final = "\x1b[2J\x1b[H"
"""Clears a terminal, and returns to its first line."""


class MessagePrinter:
    """Prints messages.

    Args:
        options: Those of `add_print_options`, and `field`, `filter`, `raw`, `clear` and
            `include_message_info`.

    Raises:
        InvalidFieldError: `--field` is not a path of fields.
        CommandError: Options exclude each other.
        InvalidFilterError: `--filter` is not a Python expression.
    """

    def __init__(self, options: argparse.Namespace) -> None:
        if options.field is not None:
            require_path(options.field)
        if options.csv and (options.json or options.raw):
            raise CommandError(f"Give --csv or {'--json' if options.json else '--raw'}, not both", USAGE)
        self._options = options
        self._chosen = None if options.filter is None else MessageFilter(options.filter)
        self._matched = False
        self._shortened: dict[str, Any] = {
            "truncate_length": None if options.full_length else options.truncate_length,
            "no_arr": options.no_arr,
            "no_str": options.no_str,
        }

    def show(self, message: Any, info: MessageInfo, decode: Callable[[bytes], Any]) -> bool:
        """Print a message, or skip it; return whether it was printed.

        Invalid bytes are reported on stderr and skipped. So is a message for which the field or the filter
        fails, if these have worked for an earlier one: the message is wrong then, not the option.

        Args:
            message: An instance of its class, a dict of its fields, or its bytes.
            info: Its metadata.
            decode: Decodes bytes.

        Raises:
            InvalidFieldError: There is no such field.
            InvalidFilterError: The filter failed.
        """
        try:
            printed = self._print(message, info, decode)
        except InvalidMessageError as error:
            print_err(peer_text(str(error)))
            return False
        except (InvalidFieldError, InvalidFilterError) as error:
            if not self._matched:
                raise
            print_err(str(error))
            return False
        self._matched = True
        return printed

    def _clear(self) -> None:
        """Clear the terminal; ROS 2 clears a file, too, with escapes that nobody reads."""
        if self._options.clear and sys.stdout.isatty():
            sys.stdout.write(CLEAR)

    def _print(self, message: Any, info: MessageInfo, decode: Callable[[bytes], Any]) -> bool:
        options = self._options
        info_fields = _info_fields(info) if options.include_message_info else None
        if options.raw and self._chosen is None:
            self._clear()
            self._show_raw(message, info_fields)
            return True
        whole = decode(message) if isinstance(message, bytes) else message
        if self._chosen is not None and not self._chosen.passes(whole):
            return False
        self._clear()
        if options.raw:
            self._show_raw(message, info_fields)
        else:
            self._show(whole if options.field is None else value_at(whole, options.field), info_fields)
        return True

    def _show(self, value: Any, info: dict[str, Any] | None) -> None:
        options = self._options
        if options.json:
            plain = message_to_ordereddict({"value": value})["value"]
            print_json(plain if info is None else {"info": info, "message": plain})
            return
        fields = isinstance(value, Message | dict)
        if fields and options.csv:
            text = message_to_csv(cast("Any", value), **self._shortened)
            print_out(text if info is None else f"{message_to_csv(info)},{text}")
            return
        if fields:
            text = message_to_yaml(cast("Any", value), flow_style=options.flow_style, **self._shortened)
        else:
            text = str(message_to_ordereddict({"value": value}, **self._shortened)["value"])
        self._show_info(info)
        print_out(text.rstrip("\n"))
        print_out("---")

    def _show_raw(self, data: bytes, info: dict[str, Any] | None) -> None:
        if self._options.json:
            document = {"msgpack": base64.b64encode(data).decode()}
            print_json(document if info is None else {"info": info, **document})
            return
        self._show_info(info)
        print_out(f"{data!r}\n---")

    def _show_info(self, info: dict[str, Any] | None) -> None:
        if info is not None:
            print_out(f"{message_to_yaml(info)}---")


def _info_fields(info: MessageInfo) -> dict[str, Any]:
    return {**info._asdict(), "publisher_gid": info.publisher_gid.hex()}
