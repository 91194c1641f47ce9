"""Where callboard is different from real ROS 2 on purpose, and the comparison of their answers."""

from __future__ import annotations

import json
from collections import Counter
from dataclasses import dataclass
from difflib import unified_diff
from typing import Final

import pytest


@dataclass(frozen=True)
class Difference:
    """Cases in which callboard's answer is another one, for one reason.

    Attributes:
        kind: What is compared, such as "program": a test has one kind.
        cases: The programs, lines or values, as `agree` gets them.
        reason: What callboard does instead, and why; for users.
    """

    kind: str
    cases: tuple[str, ...]
    reason: str


DIFFERENCES: Final = (
    Difference(
        "definition",
        (" int32 a",),
        "Lines may be indented. ROS 2 refuses it by accident (an IndexError).",
    ),
    Difference(
        "definition",
        ('string s "a#b"', 'string S="a#b"'),
        'A `#` in quotes is part of the string. ROS 2 begins a comment there, and the string is `"a`.',
    ),
    Difference(
        "definition",
        ('string s "a', "string S='a"),
        "A string that begins with a quote needs one at its end. For ROS 2 the quote is part of the string.",
    ),
    Difference(
        "definition",
        (r'string s "a\nb"', r"string s a\nb"),
        r"`\n` and `\r` are a line break and a return. ROS 2 writes an `.idl` file that it cannot read.",
    ),
    Difference(
        "definition",
        ("string s a = b", "string s x=y", "string s 'x=y'"),
        "A default may contain a `=`. ROS 2 takes the line for a constant and refuses it.",
    ),
    Difference(
        "definition",
        ("int32[] a [1,]", "int32[] a [ ]"),
        "Arrays may have a comma at their end, and a space in them.",
    ),
    Difference(
        "definition",
        ("a/msg/Pose p",),
        "The full name of a type is accepted, too.",
    ),
    Difference(
        "definition",
        ("uint8[<=4294967296] big", "string<=4294967296 s"),
        "Sizes and bounds are below 2^32: a CDR length has 32 bits.",
    ),
    Difference(
        "definition",
        ("time t", "duration d"),
        "ROS 1's types are refused with the types to use instead. ROS 2 reads them, and fails later.",
    ),
    Difference(
        "definition",
        ("Header header",),
        "In a package without such a message it is std_msgs/Header, as in ROS 1. ROS 2 refuses it.",
    ),
    Difference(
        "definition",
        ("int32 lambda", "string from"),
        "Python's keywords are refused with their line. ROS 2 warns, and makes a Python module of no use.",
    ),
    Difference(
        "definition",
        ("Pose_Request p", "Sample_Pose p"),
        "The names of generated types are refused. ROS 2 reads them, and fails later.",
    ),
    Difference(
        "definition",
        ("string[] s ['a' 'b']", "string[] s ['a'b]"),
        "Elements are separated by commas. ROS 2 needs none after a string in quotes.",
    ),
    Difference(
        "idl",
        ("struct Probe { char a; };", "struct Probe { wchar a; };", "struct Probe { long double a; };"),
        "These types, which `.msg` files do not have, are refused with those to use instead.",
    ),
    Difference(
        "idl",
        ("struct Probe { sequence<wstring<5>> a; };",),
        "The bound is the string's. ROS 2 takes it for the sequence's, too.",
    ),
    Difference(
        "idl",
        ("struct Probe { later x; }; typedef long later;",),
        "A typedef is above what uses it, as IDL has it. ROS 2 resolves all at the end.",
    ),
    Difference(
        "idl",
        (
            "struct Probe { @default (value=300) uint8 a; };",
            'struct Probe { @default (value="x") long a; };',
            "struct Probe { @default (value=true) boolean a; @default (value=false) boolean b; };",
        ),
        "Defaults are checked against their types. ROS 2 takes `false` for true.",
    ),
    Difference(
        "definition",
        ("int32 a\n ---\nint32 b", "int32 a\n--- \nint32 b"),
        "The line between request and response may have spaces around the `---`.",
    ),
    Difference(
        "package",
        ("wstring<=7[] a",),
        "The bound is that of the strings. ROS 2's IDL parser takes it for that of the sequence, too: the"
        " hash is another one, and the sequence has at most 7 elements.",
    ),
    Difference(
        "domain",
        ("5a", "a", "08", "-1", "233", "1e2"),
        "`ROS_DOMAIN_ID` is a number from 0 to 232, or else an InvalidEnvironmentError. ROS 2 has an RCLError"
        " if there are no digits, ignores what follows them, and fails later if the number is too large.",
    ),
    Difference(
        "launch value",
        ("12:30", "1:30.5"),
        "Times are strings. For ROS 2 they are numbers to the base 60: 750 and 90.5.",
    ),
    Difference(
        "launch value",
        ("2020-01-01", "null", "~", "Null", "=", "<<"),
        "Strings. launch_ros refuses what is a date or nothing to PyYAML.",
    ),
    Difference(
        "launch value",
        ("...", ":", ",", "[", "]", "{", "}", "&", "*", "!", "%", "@", "'", '"', "*a", "[1, ", "0x_"),
        "What is not YAML is a string, as in ROS 2's XML files. Of a substitution, launch_ros refuses it.",
    ),
    Difference("launch value", ("[]",), "An empty list. launch_ros refuses it."),
    Difference(
        "launch value",
        ("'y'", "'1e3'"),
        "What has quotes is a string. launch_ros loses them on the way to the node: True and 1000.0.",
    ),
    Difference(
        "launch value",
        ("4e-320", "1.5e+400"),
        "A double that is tiny is one, and one that is out of range is a string: for ROS 2 a string and inf.",
    ),
    Difference(
        "launch bool",
        ("tRue", "oN"),
        "Words of any case are truth values, as ROS 2 has it for conditions only.",
    ),
    Difference(
        "param set",
        ("1e3", "1e-3", "-.5", "4e-320", "[1e3, 1e4]"),
        "Doubles. For ROS 2 they are strings, which no double parameter takes.",
    ),
    Difference(
        "param set",
        ("12:30", "1:30.5"),
        "Times are strings. For ROS 2 they are numbers to the base 60: 750 and 90.5.",
    ),
    Difference("param set", ("1.5e+400",), "A number out of range is a string. For ROS 2 it is inf."),
    Difference(
        "param set",
        (
            "=",
            "<<",
            "?",
            "&",
            "*",
            "!",
            "%",
            "@",
            "'",
            '"',
            "a:",
            "a: b",
            "{a: 1}",
            "*a",
            "0x_",
            "2020-01-01",
        ),
        "What is no value of a parameter is a string. ROS 2's command ends with a traceback.",
    ),
    Difference(
        "param set",
        (
            "99999999999999999999",
            "-9223372036854775809",
            "999999999999999999999999999999",
            "1_000_000_000_000_000_000_000",
        ),
        "Integers of more than 64 bits are strings. ROS 2's command ends with a traceback.",
    ),
    Difference(
        "printed message",
        (
            "rcl_interfaces/msg/Parameter",
            "rcl_interfaces/msg/ParameterValue",
            "rcl_interfaces/srv/GetParameterTypes",
            "sensor_msgs/msg/CompressedImage",
            "sensor_msgs/msg/Image",
            "sensor_msgs/msg/PointCloud2",
            "std_msgs/msg/ByteMultiArray",
            "std_msgs/msg/UInt8MultiArray",
            "stereo_msgs/msg/DisparityImage",
            "visualization_msgs/msg/Marker",
            "visualization_msgs/msg/MeshFile",
        ),
        "`topic pub` and others print a sequence of bytes as `b''`. ROS 2 prints a list of numbers.",
    ),
    Difference(
        "program",
        ("declaring.odd_values",),
        "`bytes` are a byte array. Integers outside of int64, and bools among integers, are refused at once;"
        " rclpy takes them, and sends something else or raises a SystemError.",
    ),
    Difference(
        "program",
        ("declaring.byte_array_of_message",),
        "A received byte array is `bytes`; in rclpy a list of single ones.",
    ),
    Difference(
        "program",
        ("declaring.empty_lists",),
        "A list may be set to `[]`, also by an override. rclpy refuses it as a byte array, and an override of"
        " `[]` leaves the parameter without a value.",
    ),
    Difference(
        "program",
        ("declaring.reasons_for_types", "declaring.refusals_without_a_reason"),
        "The reason names the types, which rclpy shows as numbers; if a callback gives none, it says so.",
    ),
    Difference(
        "program",
        ("declaring.values_of_unknown_parameters",),
        "A request for parameters of which one is unknown or has no value is answered with the values of the"
        " others. rclpy's answer is empty.",
    ),
    Difference(
        "program",
        ("declaring.descriptor_without_type",),
        "A descriptor of no type keeps the parameter's. rclpy refuses the parameter's own value then.",
    ),
    Difference(
        "program",
        ("names.tilde_without_slash",),
        "A `~` at the beginning of a name needs a `/` after it. rclpy makes `/probea` of `~a`.",
    ),
    Difference(
        "program",
        ("names.remapped_substitution",),
        "Rules may have substitutions such as `{node}`. ROS 2 refuses them.",
    ),
    Difference(
        "program",
        ("nested.too_many_fields",),
        "A nested message with a field more than its class has is refused. rclpy leaves the field out.",
    ),
    Difference(
        "program",
        ("qos.preset_best_available",),
        "Times of this profile are unlimited. rclpy has a number for the best that is available.",
    ),
    Difference(
        "program",
        ("qos.negative_depth",),
        "A negative depth is refused at once. In rclpy it fails with the endpoint.",
    ),
    Difference(
        "program",
        ("qos.unknown_short_key",),
        "An unknown key is a ValueError that lists the known ones; in rclpy a KeyError.",
    ),
    Difference(
        "parameter",
        ("[]", "/**:\n  ros__parameters:\n    a: []"),
        "An empty list is the value of a list of any type. ROS 2 has no type for it, and no value.",
    ),
    Difference(
        "parameter",
        ("[1, [2]]",),
        "A list in a list is refused. ROS 2 forgets the outer one: the value is `[2]`.",
    ),
    Difference(
        "parameter",
        ("[a:b, c]", "%YAML 1.2\n---\nn: {ros__parameters: {a: 1}}"),
        "YAML 1.2 is read. ROS 2's YAML parser knows 1.1, and in brackets no plain text with a colon.",
    ),
    Difference(
        "parameter",
        (
            "/**:\n  ros__parameters:\n    a: [1.5]\n    a: ['b']",
            "/**:\n  ros__parameters:\n    a: 1\n    a: x",
            "n: {ros__parameters: {a: true}}\n---\nn: {ros__parameters: {a: 2}}",
            "/**:\n  ros__parameters: {a: 1, a: x}",
        ),
        "The last of two values counts. ROS 2 keeps the one whose type comes first: bool, integer, double,"
        " string, and lists of these.",
    ),
    Difference(
        "parameter",
        ("/**:\n  ros__parameters:\n    - a: 1", "/**:\n  ros__parameters:\n    a:\n    - b: 1"),
        "A mapping in a list is refused. ROS 2 reads lists: `a` or `a.b` is `[1]`.",
    ),
    Difference(
        "parameter",
        ("/**:\n  ros__parameters: {a.b: {c.d: {x: 1}, y: 2}}",),
        "`y` is in `a.b`. After a name with dots ROS 2 continues in the wrong mapping: `a.b.c.y`.",
    ),
    Difference(
        "parameter",
        ("a file of all nodes and the node, and a rule",),
        "The last value counts, so that `-p` overrules files. In ROS 2 a file for the node wins over `-p` if"
        " a section for all nodes, `/**`, comes before it.",
    ),
    Difference(
        "parameter",
        ("/**:\n  ros__parameters:\n    a: {}",),
        "An empty mapping has no parameters. ROS 2 refuses it.",
    ),
    Difference(
        "parameter",
        ("/**:\n  ros__parameters: {a: 1, <<: 2}",),
        "A merge key is refused, with what to do instead. For ROS 2 it is a parameter named `<<`.",
    ),
    Difference(
        "parameter",
        ("text", "/**:\n  ros__parameters: []"),
        "A word or a list where a mapping belongs is refused. ROS 2 reads nothing in it.",
    ),
    Difference(
        "message value",
        ("String: Decimal, assigned", "String: Decimal, constructed"),
        "A Decimal, UUID or date in a string field is sent as text. rclpy raises a TypeError.",
    ),
    Difference(
        "message value",
        ("Bool: 0, assigned", "Bool: 0, constructed"),
        "Numbers in a bool field are refused. rclpy sends False for all of them, for 1 too.",
    ),
    Difference(
        "program",
        ("times.fractions",),
        "Parts of a nanosecond are rounded, and text is a TypeError. rclpy cuts them off, and reads text.",
    ),
    Difference(
        "program",
        ("times.times_of_two_clocks",),
        "Times of two clocks are unequal. rclpy raises a TypeError.",
    ),
    Difference(
        "program",
        ("entities.wrong_types",),
        "A TypeError that names the class. rclpy raises an AttributeError or a RuntimeError.",
    ),
    Difference(
        "program",
        ("entities.services_of_a_node",),
        "A node also has the service `~/get_diagnostics`.",
    ),
    Difference(
        "program",
        ("entities.cancelled_future",),
        "A cancelled future is done.",
    ),
    Difference(
        "program",
        ("executing.shutdown_that_waits",),
        "`shutdown(timeout_sec)` of an executor returns False if a callback still runs, as it is documented."
        " rclpy's returns True.",
    ),
    Difference(
        "program",
        ("actions.wrong_answers_to_cancellations",),
        "The response to a cancellation that is rejected has the code for it, as in C++. rclpy's has none.",
    ),
    Difference(
        "program",
        ("actions.wrong_result",),
        "A result that is None is an empty one. rclpy raises an AttributeError where the server spins.",
    ),
    Difference(
        "program",
        ("content_filters.regular_expressions", "content_filters.patterns_in_messages"),
        "A content filter has no MATCH, no regular expression in LIKE's pattern and no field as the pattern:"
        " each is an RCLError. Fast DDS compiles them as regular expressions, which can take for ever.",
    ),
    Difference(
        "program",
        ("content_filters.characters_that_are_no_ascii",),
        "`_` of LIKE is one character. For Fast DDS it is one byte, and it compares at most 255 bytes.",
    ),
    Difference(
        "program",
        ("content_filters.octal_numbers",),
        "`08` is refused: a number that begins with 0 is octal. Fast DDS reads 0.",
    ),
    Difference(
        "program",
        ("content_filters.elements_that_are_missing",),
        "A message without an element that the filter names is not received. In Fast DDS the alphabetical"
        " order of the fields decides which of them are looked at.",
    ),
    Difference(
        "program",
        ("shutting_down.too_late_with_an_executor",),
        "An ExternalShutdownException, as for a shutdown while it waits. rclpy raises an RCLError.",
    ),
    Difference(
        "cdr",
        ("std_msgs/msg/String: 00070000 02000000 6100",),
        "Bytes in another representation than plain CDR are refused. rclpy takes some of them for plain CDR.",
    ),
    Difference(
        "cdr",
        ("test_msgs/action/Fibonacci_GetResult_Response: 00010000 04000000 02000000",),
        "A message that is too short is refused. rclpy reads an empty sequence if its length exceeds what is"
        " left, and it is in a nested message.",
    ),
    Difference(
        "cdr",
        ("test_msgs/msg/Strings: 00010000 0100000000000000 01000000000000",),
        "A string beyond its bound is refused. rclpy reads and writes it.",
    ),
)

_CASES: Final = {(each.kind, case) for each in DIFFERENCES for case in each.cases}
_equal: Final[Counter[str]] = Counter()
_listed: Final[Counter[str]] = Counter()


def agree(kind: str, case: str, *, real: object, callboard: object) -> None:
    """Fail unless two answers are equal, or differ and are listed.

    1, 1.0 and True are different answers, and NaN is equal to itself.

    Args:
        kind: What is compared.
        case: Of which question: as it is in `DIFFERENCES` if it is there.
        real: Real ROS 2's answer, of what JSON has.
        callboard: Callboard's.
    """
    truth, answer = (
        json.dumps(each, indent=1, sort_keys=True, default=list).splitlines() for each in (real, callboard)
    )
    if (kind, case) in _CASES:
        assert answer != truth, f"{kind} {case} is equal: remove it from DIFFERENCES"
        _listed[kind] += 1
        return
    if answer != truth:
        text = "\n".join(unified_diff(truth, answer, "real ROS 2", "callboard", lineterm=""))
        pytest.fail(f"{kind} {case}:\n{text}", pytrace=False)
    _equal[kind] += 1


def counts() -> dict[str, tuple[int, int]]:
    """Return for each kind how many cases of this process were equal, and how many are listed."""
    return {kind: (_equal[kind], _listed[kind]) for kind in _equal | _listed}


def reference() -> str:
    """Return the list as a table in Markdown."""
    rows = [f"| {each.kind} | {', '.join(map(_code, each.cases))} | {each.reason} |" for each in DIFFERENCES]
    return "\n".join(["| kind | cases | callboard |", "|---|---|---|", *rows]) + "\n"


def _code(case: str) -> str:
    return "`" + case.replace("\n", r"\n").replace("|", r"\|") + "`"
