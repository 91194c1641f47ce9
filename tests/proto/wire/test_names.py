"""Names: every rule with the index of the fault, expansion, and properties that hold for any text."""

from __future__ import annotations

import re
import time
from typing import TYPE_CHECKING

import pytest
from hypothesis import given
from hypothesis import strategies as st

from proto.errors import (
    CallboardError,
    InvalidNameError,
    InvalidNamespaceError,
    InvalidNodeNameError,
    InvalidServiceNameError,
    InvalidTopicNameError,
)
from proto.wire.names import (
    expand_topic_name,
    full_node_name,
    is_hidden,
    normalize_namespace,
    split_node_name,
    validate_full_service_name,
    validate_full_topic_name,
    validate_namespace,
    validate_node_name,
    validate_topic_name,
)

if TYPE_CHECKING:
    from collections.abc import Callable

TOKENS = st.from_regex(r"[A-Za-z_][A-Za-z0-9_]{0,8}", fullmatch=True)
FULL_NAMES = st.lists(TOKENS, min_size=1, max_size=5).map(lambda tokens: "/" + "/".join(tokens))
NAMESPACES = st.one_of(st.just("/"), FULL_NAMES)
TEXTS = st.one_of(st.text(), st.text(alphabet="ab1_/~{} é\n", max_size=12))


@pytest.mark.parametrize("name", ["nodename", "node_name", "_n", "N9", "a" * 255])
def test_valid_node_names(name: str) -> None:
    """Letters, digits and underscores, up to 255 of them."""
    validate_node_name(name)


@pytest.mark.parametrize(
    ("name", "index", "reason"),
    [
        ("", 0, "empty"),
        ("node/name", 4, "characters"),
        ("node_{name}", 5, "characters"),
        ("~node_name", 0, "characters"),
        ("with spaces", 4, "characters"),
        ("with.periods", 4, "characters"),
        ("nöde", 1, "characters"),
        ("node\n", 4, "characters"),
        ("42node", 0, "start with a number"),
        ("٣node", 0, "characters"),
        ("a" * 256, 254, "longer than 255"),
        ("0" * 256, 0, "start with a number"),
    ],
)
def test_invalid_node_names(name: str, index: int, reason: str) -> None:
    """The rule and the index are exact; the length is checked last."""
    with pytest.raises(InvalidNodeNameError, match=reason) as caught:
        validate_node_name(name)
    assert caught.value.index == index


@pytest.mark.parametrize("namespace", ["/", "/my_ns", "/with_one/heirarchy", "/" + "a" * 244])
def test_valid_namespaces(namespace: str) -> None:
    """The root, absolute names, up to 245 characters."""
    validate_namespace(namespace)


@pytest.mark.parametrize(
    ("namespace", "index", "reason"),
    [
        ("", 0, "empty"),
        ("not_absolute", 0, "absolute"),
        ("/ends/with/", 10, "end with"),
        ("/9starts_with_number", 1, "starts with a number"),
        ("/starts/42with/number", 8, "starts with a number"),
        ("//double", 1, "repeated"),
        ("/with spaces", 5, "characters"),
        ("/" + "a" * 245, 244, "longer than 245"),
    ],
)
def test_invalid_namespaces(namespace: str, index: int, reason: str) -> None:
    """Each rule, with its index."""
    with pytest.raises(InvalidNamespaceError, match=reason) as caught:
        validate_namespace(namespace)
    assert caught.value.index == index


@pytest.mark.parametrize("name", ["/chatter", "/ns/node_name/chatter", "/" + "a" * 246])
def test_valid_full_names(name: str) -> None:
    """Absolute names up to 247 characters, for topics and services."""
    validate_full_topic_name(name)
    validate_full_service_name(name)


@pytest.mark.parametrize(
    ("name", "index", "reason"),
    [
        ("", 0, "empty"),
        ("/", 0, "end with"),
        ("/ends/with/", 10, "end with"),
        ("/~/unexpanded_tilde", 1, "characters"),
        ("/unexpanded_sub/{node}", 16, "characters"),
        ("/question?", 9, "characters"),
        ("/with spaces", 5, "characters"),
        ("/line\n", 5, "characters"),
        ("invalid_topic", 0, "absolute"),
        ("/foo//bar", 5, "repeated"),
        ("/foo/42bar", 5, "starts with a number"),
        ("/" + "a" * 247, 246, "longer than 247"),
        ("/" + "a" * 300 + "/1", 302, "starts with a number"),
    ],
)
def test_invalid_full_names(name: str, index: int, reason: str) -> None:
    """Each rule, with its index; services have their own error and wording."""
    with pytest.raises(InvalidTopicNameError, match=f"topic name .*{reason}") as caught:
        validate_full_topic_name(name)
    assert caught.value.index == index
    with pytest.raises(InvalidServiceNameError, match=f"service name .*{reason}") as caught_service:
        validate_full_service_name(name)
    assert caught_service.value.index == index


@pytest.mark.parametrize(
    "name",
    [
        *("foo", "abc123", "_foo", "Foo", "BAR", "~", "foo/bar", "~/foo", "foo/_bar", "foo_/bar", "/bar/baz"),
        *("{foo}_bar", "foo/{ping}/bar", "{_bar}", "foo//bar", "{}", "{a}1"),
    ],
)
def test_valid_unexpanded_names(name: str) -> None:
    """Substitutions and doubled slashes pass before expansion."""
    validate_topic_name(name)
    validate_topic_name(name, is_service=True)


@pytest.mark.parametrize(
    ("name", "index", "reason"),
    [
        ("", 0, "empty"),
        ("123abc", 0, "start with a number"),
        ("foo/123bar", 4, "start with a number"),
        (" ", 0, "characters"),
        ("foo bar", 3, "characters"),
        ("chatter?", 7, "must not contain characters"),
        ("/~", 1, "unless it is the first"),
        ("foo~", 3, "unless it is the first"),
        ("foo/~bar", 4, "unless it is the first"),
        ("foo/~/bar", 4, "unless it is the first"),
        ("~foo", 1, "not followed by"),
        ("~f", 1, "not followed by"),
        ("foo/", 3, "end with"),
        ("/", 0, "end with"),
        ("foo/bar}/baz", 7, "unmatched"),
        ("foo/{bar", 4, "unmatched"),
        ("{$}", 1, "substitution name"),
        ("{{bar}_baz}", 1, "substitution name"),
        ("foo/{bar/baz}", 8, "substitution name"),
        ("{1foo}", 1, "substitution name must not start with a number"),
        ("{~}", 1, "substitution name"),
    ],
)
def test_invalid_unexpanded_names(name: str, index: int, reason: str) -> None:
    """Each rule, with its index; services have their own error."""
    with pytest.raises(InvalidTopicNameError, match=reason) as caught:
        validate_topic_name(name)
    assert caught.value.index == index
    with pytest.raises(InvalidServiceNameError, match=reason) as caught_service:
        validate_topic_name(name, is_service=True)
    assert caught_service.value.index == index


def test_error_text_has_three_lines() -> None:
    """The rule, the quoted name, and a caret below the fault."""
    with pytest.raises(InvalidNodeNameError) as caught:
        validate_node_name("node/name")
    assert str(caught.value) == (
        "Invalid node name: node name must not contain characters other than alphanumerics or '_':\n"
        "  'node/name'\n"
        "       ^"
    )
    assert isinstance(caught.value, ValueError)
    assert isinstance(caught.value, CallboardError)


@pytest.mark.parametrize(
    ("name", "quoted", "caret"),
    [
        ("/a\x1b[2Jb", r"'/a\x1b[2Jb'", 3 + 2),
        ("/a\nb", r"'/a\nb'", 3 + 2),
        ("/a/\u202e", r"'/a/\u202e'", 3 + 3),
        ("/é漢 b", r"'/é\u6f22 b'", 3 + 1),
    ],
)
def test_error_text_is_escaped(name: str, quoted: str, caret: int) -> None:
    """Control, bidirectional and double-width characters are escaped and the caret stays in place."""
    with pytest.raises(InvalidTopicNameError) as caught:
        validate_full_topic_name(name)
    _, shown_name, caret_line = str(caught.value).splitlines()
    assert shown_name == f"  {quoted}"
    assert caret_line == " " * caret + "^"


def test_caret_counts_escapes_before_it() -> None:
    """The caret is right although escaping has widened the text before it."""
    text = str(InvalidTopicNameError("topic name", "\x00\x00?", "reason", 2))
    assert text.splitlines()[1:] == [r"  '\x00\x00?'", " " * 11 + "^"]


@pytest.mark.parametrize("index", [0, 500_000, 999_999])
def test_error_text_of_a_huge_name_is_short(index: int) -> None:
    """A megabyte of name quotes only the neighbourhood of the fault."""
    name = "a" * index + "?" + "a" * (999_999 - index)
    text = str(InvalidTopicNameError("topic name", name, "reason", index))
    _, quoted, caret = text.splitlines()
    assert len(text) < 300
    assert quoted[len(caret) - 1] == "?"


@pytest.mark.parametrize("value", [None, 42, b"/foo", ["/foo"]])
def test_non_strings_are_type_errors(value: str) -> None:
    """Anything but a str is a TypeError that names the type."""
    checks = (
        validate_node_name,
        validate_namespace,
        validate_full_topic_name,
        validate_full_service_name,
        validate_topic_name,
        is_hidden,
    )
    for check in checks:
        with pytest.raises(TypeError, match=f"must be a str, not {type(value).__name__}"):
            check(value)


@pytest.mark.parametrize("name", ["/chatter", "chatter", "/more/complex_/chatter", "/chatter_", ""])
def test_not_hidden(name: str) -> None:
    """An underscore elsewhere than at the start of a token hides nothing."""
    assert not is_hidden(name)


@pytest.mark.parametrize(
    "name", ["/_chatter", "_chatter", "/_more/x", "/more/_complex/chatter", "/more/complex/_/chatter", "_"]
)
def test_hidden(name: str) -> None:
    """Any token that begins with an underscore hides the name."""
    assert is_hidden(name)


@pytest.mark.parametrize(
    ("topic", "node", "namespace", "full"),
    [
        ("chatter", "node_name", "/ns", "/ns/chatter"),
        ("chatter", "node_name", "/", "/chatter"),
        ("~/chatter", "node_name", "/ns", "/ns/node_name/chatter"),
        ("~/chatter", "node_name", "/", "/node_name/chatter"),
        ("~", "my_node", "/", "/my_node"),
        ("~", "my_node", "/my_ns", "/my_ns/my_node"),
        ("/chatter", "my_node", "/my_ns", "/chatter"),
        ("{node}/chatter", "my_node", "/my_ns", "/my_ns/my_node/chatter"),
        ("{ns}", "my_node", "/my_ns", "/my_ns"),
        ("{namespace}", "my_node", "/my_ns", "/my_ns"),
        ("/foo/{namespace}", "my_node", "/my_ns", "/foo//my_ns"),
        ("/{node}{node}", "n", "/my_ns", "/nn"),
        ("~/{node}", "n", "/my_ns", "/my_ns/n/n"),
        ("topic", "node", "/", "/topic"),
        ("topic", "node", "/ns", "/ns/topic"),
        ("example/topic", "node", "/my/ns", "/my/ns/example/topic"),
        ("/topic", "node", "/ns", "/topic"),
    ],
)
def test_expansion(topic: str, node: str, namespace: str, full: str) -> None:
    """Tilde, substitutions and namespace, for topics and services alike."""
    assert expand_topic_name(topic, node, namespace) == full
    assert expand_topic_name(topic, node, namespace, is_service=True) == full


def test_expansion_can_validate_its_result() -> None:
    """The doubled slash is rejected by the check of the full name."""
    with pytest.raises(InvalidTopicNameError, match="repeated"):
        expand_topic_name("/foo/{namespace}", "my_node", "/my_ns", validate=True)
    with pytest.raises(InvalidServiceNameError, match="repeated"):
        expand_topic_name("/foo/{ns}", "my_node", "/my_ns", is_service=True, validate=True)
    assert expand_topic_name("foo", "my_node", "/my_ns", validate=True) == "/my_ns/foo"


@pytest.mark.parametrize(("topic", "index"), [("{doesnotexist}", 0), ("{ns}/{bad_sub}", 5), ("~/{}", 2)])
def test_unknown_substitution(topic: str, index: int) -> None:
    """The error names the substitution and its index in the given name."""
    with pytest.raises(InvalidTopicNameError, match="unknown substitution") as caught:
        expand_topic_name(topic, "node", "/ns")
    assert (caught.value.name, caught.value.index) == (topic, index)


@pytest.mark.parametrize(
    ("topic", "node", "namespace", "error"),
    [
        ("chatter", "node/name", "/ns", InvalidNodeNameError),
        ("chatter", "node_name", "", InvalidNamespaceError),
        ("chatter", "node_name", "ns", InvalidNamespaceError),
        ("invalid topic", "node_name", "/ns", InvalidTopicNameError),
    ],
)
def test_expansion_says_which_argument_is_wrong(
    topic: str, node: str, namespace: str, error: type[InvalidNameError]
) -> None:
    """Each bad argument has its own error type."""
    with pytest.raises(error):
        expand_topic_name(topic, node, namespace)
    if error is InvalidTopicNameError:
        with pytest.raises(InvalidServiceNameError):
            expand_topic_name(topic, node, namespace, is_service=True)


@pytest.mark.parametrize(
    ("given_ns", "full"), [("", "/"), ("ns", "/ns"), ("/", "/"), ("/ns", "/ns"), ("a/b", "/a/b")]
)
def test_normalize_namespace(given_ns: str, full: str) -> None:
    """An empty namespace is the root, and a relative one is absolute."""
    assert normalize_namespace(given_ns) == full


def test_split_node_name() -> None:
    """A full node name splits at its last slash; a bare name lives in the root."""
    assert split_node_name("/n") == ("/", "n")
    assert split_node_name("/a/b/n") == ("/a/b", "n")
    assert split_node_name("n") == ("/", "n")


@given(NAMESPACES, TOKENS)
def test_full_node_name_splits_again(namespace: str, name: str) -> None:
    """Joining and splitting a node name are inverse."""
    assert split_node_name(full_node_name(namespace, name)) == (namespace, name)


@given(FULL_NAMES)
def test_tokens_joined_are_valid_everywhere(name: str) -> None:
    """What is a full name is a valid unexpanded name and expands to itself."""
    validate_full_topic_name(name)
    validate_namespace(name)
    validate_topic_name(name)
    assert expand_topic_name(name, "node", "/ns") == name


@given(FULL_NAMES.map(lambda name: name[1:]), TOKENS, NAMESPACES)
def test_relative_names_expand_to_valid_ones(topic: str, node: str, namespace: str) -> None:
    """A plain relative name always expands to a valid full name below its namespace."""
    full = expand_topic_name(topic, node, namespace, validate=True)
    assert full.endswith("/" + topic)
    assert full.startswith(namespace)


def fault_of(check: Callable[[], object]) -> InvalidNameError | None:
    try:
        check()
    except InvalidNameError as error:
        return error
    return None


@given(TEXTS)
def test_full_name_check_agrees_with_its_definition(name: str) -> None:
    """Accepted names are exactly the absolute ASCII ones within the limit, and a fault is inside the name."""
    right = bool(re.fullmatch(r"(/[A-Za-z_][A-Za-z0-9_]*)+", name)) and len(name) <= 247
    fault = fault_of(lambda: validate_full_topic_name(name))
    assert right == (fault is None)
    if fault is not None:
        assert 0 <= fault.index < max(1, len(name))
        assert all(line.isprintable() for line in str(fault).split("\n"))


@given(TEXTS)
def test_node_name_check_agrees_with_its_definition(name: str) -> None:
    """Accepted node names are exactly the ASCII identifiers within the limit."""
    right = name.isascii() and name.isidentifier() and len(name) <= 255
    assert right == (fault_of(lambda: validate_node_name(name)) is None)


@given(TEXTS, TOKENS, NAMESPACES)
def test_unexpanded_names_never_surprise(name: str, node: str, namespace: str) -> None:
    """Any text either expands to an absolute name or raises the topic error with an index inside the text."""
    fault = fault_of(lambda: expand_topic_name(name, node, namespace))
    if fault is None:
        full = expand_topic_name(name, node, namespace)
        assert full.startswith("/")
        assert not set(full) & set("~{} \n")
    else:
        assert isinstance(fault, InvalidTopicNameError)
        assert 0 <= fault.index < max(1, len(name))
        assert len(str(fault).split("\n")) == 3


@pytest.mark.parametrize(
    "name", ["/" * 100_000, "{a}" * 50_000 + "}", "{" * 100_000, "/a" * 100_000, "~" * 100_000]
)
def test_hostile_names_take_linear_time(name: str) -> None:
    """Long names that are wrong only at the end are diagnosed without backtracking."""
    assert fault_of(lambda: validate_full_topic_name(name)) is not None
    started = time.process_time()
    fault_of(lambda: validate_topic_name(name))
    assert time.process_time() - started < 1.0
