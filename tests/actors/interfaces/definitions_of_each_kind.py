"""Definitions with a field of each kind, and a package of them."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from pathlib import Path

EVERYTHING = """
int8 LOW=-5
string NAME="a \\"b\\""
byte B=3
std_msgs/Header header
geometry_msgs/Point point
Point own_point
std_msgs/Int8MultiArray array
bool yes true
byte one 7
char letter 65
float32 f 1.5
float64 inf_value inf
int64 i -5
uint64 big 18446744073709551615
string s "it's \\"quoted\\""
string<=5 bounded
wstring wide
uint8[] data [1, 2]
byte[4] four
uint8[<=9] some
float64[] doubles [1, 2.5]
float64[3] three
int32[<=3] few [7]
bool[2] flags
string[] texts ["a", 'b']
string<=3[2] pair
Point[] points
Point[2] two
geometry_msgs/Pose[<=3] a_very_long_field_name_that_makes_the_line_too_long_for_the_formatter_and_must_wrap
"""


KINDS = """
{0}bool {1}
byte {1}
char {1} 7
int32 {1} 5
float32 {1} inf
float64 {1} nan
string {1} "("
string<=5 {1}
wstring {1}
uint8[3] {1}
bool[] {1}
string<=3[<=2] {1} ["a"]
int32[2] {1}
float64[] {1} [1, 2]
std_msgs/Header {1}
geometry_msgs/Point[2] {1}
geometry_msgs/Point[] {1}
""".strip().splitlines()
"""A field of each kind that the generator treats in its own way."""

LONG = """
string A="{}("
string B="{}"
string C="{}"
string<=500 bounded "{}"
string plain "{}"
string<=500 plain2 "{}"
string[] several ["{}", "{}", "c"]
string[] one ["{}"]
float64[] numbers [{}]
float64[9] nine [1.5, 2.5, 3.5, 4.5, 5.5, 6.5, 7.5, 8.5, 9.5]
geometry_msgs/TwistWithCovarianceStamped[3] the_name_of_this_field_is_so_long_that_it_must_be_broken
uint8[] data [{}]
""".format(
    "a(" * 50, "b" * 77, "c" * 78, "d" * 120, "e" * 80, "f" * 66, "g" * 50, "h" * 50, "i" * 80,
    ", ".join(["1.25"] * 30), ", ".join(["7"] * 60),
)  # fmt: skip


def fields(name: str, others: str = "") -> str:
    """Return a message whose first field has a name; one of each kind follows, as it may hide names."""
    lines = [f"{kind.format(others, f'x{number}')}" for number, kind in enumerate(KINDS)]
    return "\n".join([f"int32 {name} 3", *lines])


def write_package(folder: Path) -> Path:
    """Write the definitions of the package robot_test_msgs below a folder; return the package's."""
    package = folder / "robot_test_msgs"
    for name, text in {
        "msg/Everything.msg": EVERYTHING,
        "msg/Point.msg": "float32 x\nfloat32 y",
        "msg/Empty.msg": "# nothing",
        "srv/Home.srv": "Point where\n---\nbool ok\nstring message",
        "msg/Long.msg": LONG,
        "srv/Long.srv": f"{LONG}\n---\n{LONG}",
        "msg/Names.msg": fields("list", "string str # (\nbool bool\nint32 msgspec\nint32 int32\n"),
        "msg/Message.msg": fields("float"),
        "srv/Service.srv": "Message message\nstring range\n---\nstring<=5[] list",
        "srv/Nothing.srv": "---",
        "action/Drive.action": "Point to\n---\nfloat64 length\n---\nPoint at",
    }.items():
        path = package / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
    return package
