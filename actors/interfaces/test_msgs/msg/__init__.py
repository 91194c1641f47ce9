"""Messages of test_msgs."""

from typing import TYPE_CHECKING

from actors.interfaces.lazy import lazy_exports

if TYPE_CHECKING:
    from actors.interfaces.test_msgs.msg._arrays import Arrays
    from actors.interfaces.test_msgs.msg._basic_types import BasicTypes
    from actors.interfaces.test_msgs.msg._bounded_plain_sequences import BoundedPlainSequences
    from actors.interfaces.test_msgs.msg._bounded_sequences import BoundedSequences
    from actors.interfaces.test_msgs.msg._builtins import Builtins
    from actors.interfaces.test_msgs.msg._constants import Constants
    from actors.interfaces.test_msgs.msg._defaults import Defaults
    from actors.interfaces.test_msgs.msg._empty import Empty
    from actors.interfaces.test_msgs.msg._multi_nested import MultiNested
    from actors.interfaces.test_msgs.msg._nested import Nested
    from actors.interfaces.test_msgs.msg._strings import Strings
    from actors.interfaces.test_msgs.msg._unbounded_sequences import UnboundedSequences
    from actors.interfaces.test_msgs.msg._w_strings import WStrings

__all__ = [
    "Arrays",
    "BasicTypes",
    "BoundedPlainSequences",
    "BoundedSequences",
    "Builtins",
    "Constants",
    "Defaults",
    "Empty",
    "MultiNested",
    "Nested",
    "Strings",
    "UnboundedSequences",
    "WStrings",
]

if not TYPE_CHECKING:
    __getattr__ = lazy_exports(
        __name__,
        {
            "Arrays": "_arrays",
            "BasicTypes": "_basic_types",
            "BoundedPlainSequences": "_bounded_plain_sequences",
            "BoundedSequences": "_bounded_sequences",
            "Builtins": "_builtins",
            "Constants": "_constants",
            "Defaults": "_defaults",
            "Empty": "_empty",
            "MultiNested": "_multi_nested",
            "Nested": "_nested",
            "Strings": "_strings",
            "UnboundedSequences": "_unbounded_sequences",
            "WStrings": "_w_strings",
        },
    )
