"""Interfaces with what they contain below, and with the comments that are wanted."""

from __future__ import annotations

import pytest

from actors.interfaces.errors import InterfaceSyntaxError
from actors.interfaces.outline import MAX_LINES, Comments, outline

TEXTS = {
    "robots/msg/Arm": (
        '# An arm\n\nHand left  # of two\nHeader header\nstring NAME="#1"\ngrips/Grip[<=3] grips\n# end\n'
    ),
    "robots/msg/Hand": "# A hand\nint32 fingers # five\n",
    "std_msgs/msg/Header": "string frame_id\n",
    "robots/srv/Wave": "Hand hand\n---\n# the answer\nbool ok\n",
}


@pytest.mark.parametrize(
    ("comments", "lines"),
    [
        (
            Comments.OWN,
            [
                "# An arm",
                "",
                "Hand left  # of two",
                "\tint32 fingers",
                "Header header",
                "\tstring frame_id",
                'string NAME="#1"',
                "grips/Grip[<=3] grips",
                "# end",
            ],
        ),
        (
            Comments.ALL,
            [
                "# An arm",
                "",
                "Hand left  # of two",
                "\t# A hand",
                "\tint32 fingers # five",
                "Header header",
                "\tstring frame_id",
                'string NAME="#1"',
                "grips/Grip[<=3] grips",
                "# end",
            ],
        ),
        (
            Comments.NONE,
            [
                "Hand left",
                "\tint32 fingers",
                "Header header",
                "\tstring frame_id",
                'string NAME="#1"',
                "grips/Grip[<=3] grips",
            ],
        ),
    ],
)
def test_comments(comments: Comments, lines: list[str]) -> None:
    """As ROS 2 shows them; what is not known is not expanded."""
    assert outline("robots/msg/Arm", TEXTS.get, comments) == lines


def test_parts_are_separated() -> None:
    """A service's request and response, whatever the comments."""
    assert outline("robots/srv/Wave", TEXTS.get, Comments.NONE) == [
        "Hand hand",
        "\tint32 fingers",
        "---",
        "bool ok",
    ]


def test_an_unknown_interface_has_no_lines() -> None:
    """Its text is nothing."""
    assert outline("robots/msg/Leg", TEXTS.get) == []


def test_a_message_that_contains_itself_is_refused() -> None:
    """A definition from afar may say so."""
    with pytest.raises(InterfaceSyntaxError, match="levels deep"):
        outline("robots/msg/Snake", {"robots/msg/Snake": "Snake tail\n"}.get)


def test_a_message_that_grows_without_end_is_refused() -> None:
    """Each of ten levels holds the next one ten times."""
    texts = {f"robots/msg/L{n}": f"L{n + 1} x\n" * 10 for n in range(10)}
    with pytest.raises(InterfaceSyntaxError, match=f"more than {MAX_LINES} lines"):
        outline("robots/msg/L0", texts.get)


def test_a_header_of_the_package_itself() -> None:
    """It goes before that of std_msgs."""
    texts = {
        **TEXTS,
        "robots/msg/Header": "int8 own\n",
        "robots/msg/Leg": "Header header\nstd_msgs/Header other\n",
    }
    lines = outline("robots/msg/Leg", texts.get)
    assert lines == ["Header header", "\tint8 own", "std_msgs/Header other", "\tstring frame_id"]
