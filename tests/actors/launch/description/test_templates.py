"""Tests of actors.launch.description.templates."""

from __future__ import annotations

from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from actors.launch.description.substitutions import LaunchConfiguration, Substitution, resolve
from actors.launch.description.templates import known_substitutions, template, words
from actors.launch.errors import LaunchError
from tests.actors.launch.fake_library import scope
from tests.calls import calls_of


def said(text: str) -> str:
    """Return what a template stands for in a made-up place."""
    here = scope(
        launch_configurations={"robot": "r2", "r2_x": "nested", "two words": "yes"},
        environment={"HOME": "/home/me", "ROBOT": "robot", "PATH": "ls"},
        folder="/files",
        file="/files/a.launch.yaml",
    )
    return resolve(template(text), here)


@pytest.mark.parametrize(
    ("text", "meant"),
    [
        ("", ""),
        ("plain", "plain"),
        ("$(var robot)", "r2"),
        ("a $(var robot)_camera b", "a r2_camera b"),
        ("$(var robot)$(var robot)", "r2r2"),
        ("$(var  robot )", "r2"),
        ("$(var none default)", "default"),
        ("$(var none '')", ""),
        ("$(var 'two words')", "yes"),
        ('$(var "two words")', "yes"),
        (r"$(var two\ words)", "yes"),
        ("$(var $(env ROBOT))", "r2"),
        ("$(var $(var robot)_x)", "nested"),
        ("$(var '$(var robot)_x')", "nested"),
        ("$(env HOME)/x", "/home/me/x"),
        ("$(env NONE '/tmp x')", "/tmp x"),
        ("$(env NONE $(env HOME))", "/home/me"),
        ("$(env NONE 'it\\'s')", "it's"),
        ("$(env NONE '\"$(var robot)\" (x)')", '"r2" (x)'),
        ("$(dirname)/a", "/files/a"),
        ("$(filename)", "/files/a.launch.yaml"),
        ("$(find-pkg-share my_package)/x", "/share/my_package/x"),
        ("$(find-pkg-prefix my_package)/x", "/prefix/my_package/x"),
        ("$(exec-in-pkg talker my_package)", "/prefix/lib/my_package/talker"),
        ("$(find-exec ls)", "/bin/ls"),
        ("$(command 'xacro $(dirname)/a b')", "xacro /files/a b said"),
        ("$(anon talker)", "talker_unique_1"),
        ("$(file-content notes.txt)", "text of /files/notes.txt"),
        ("$(path-join $(dirname) a b.yaml)", "/files/a/b.yaml"),
        ('$(eval \'"$(var robot)" == "r2" and 1 + 2 > 2\')', "True"),
        ("$(eval '\\'$(var robot)\\' * 2')", "r2r2"),
        ("$(not false) $(and true false) $(or true false)", "true false true"),
        ("$(all true true) $(any false false)", "true false"),
        ("$(equals $(var robot) r2) $(not-equals a b)", "true true"),
        ("$(if true yes no) $(if $(equals a b) yes)", "yes "),
        (r"\$(var robot)", "$(var robot)"),
        (r"a\\b\"c\'", "a\\b\"c'"),
        ("ends with \\", "ends with \\"),
        ("costs $5, $ or $$", "costs $5, $ or $$"),
        ('it\'s "quoted" (here)', 'it\'s "quoted" (here)'),
    ],
)
def test_a_template_stands_for_a_text(text: str, meant: str) -> None:
    """Substitutions, quotes and backslashes mean what they do in ROS 2's launch files."""
    assert said(text) == meant


def test_a_template_is_no_more_than_it_must_be() -> None:
    """A plain text stays one, and a substitution alone is itself."""
    assert template("plain") == "plain"
    assert template("$(var robot)") == LaunchConfiguration("robot")
    assert template("a$(var robot)") == ("a", LaunchConfiguration("robot"))


@pytest.mark.parametrize(
    ("text", "error"),
    [
        ("a $(var robot", r"\$\( is not closed, at '\$\(var robot'"),
        ("$(var 'robot)", r"' is not closed, at ''robot\)'"),
        ("$()", r"\$\( needs the name of a substitution; write \\\$\( for the text itself"),
        ("$( var x)", r"\$\( needs the name"),
        ("$(vra x)", "No substitution 'vra'; did you mean 'var'?"),
        ("$(qqqqqq x)", "No substitution 'qqqqqq'; there is all, and, anon, any, "),
        ("$(var)", r"'\$\(var\)' should be \$\(var NAME\) or"),
        ("$(var a b c)", r"'\$\(var a b c\)' should be .*; an argument with spaces in it needs quotes"),
        ("$(dirname x)", r"'\$\(dirname x\)' should be \$\(dirname\);"),
        ("$(var a(b)", r"\( needs a backslash before it, or quotes around the whole argument, at '\(b\)'"),
        ("$(var it's)", "' needs a backslash before it"),
        ("$(var 'a'b)", r"a space or \) is missing, at 'b\)'"),
        ("$(var " * 30, "Substitutions are nested deeper than 20"),
        ("a\0b", "A text cannot have a null character in it"),
    ],
)
def test_what_is_malformed_is_an_error(text: str, error: str) -> None:
    """It says what is wrong, and where."""
    with pytest.raises(LaunchError, match=error):
        template(text)


@pytest.mark.parametrize(
    ("text", "meant"),
    [
        ("", []),
        ("  ", []),
        ("ls -l  -a", ["ls", "-l", "-a"]),
        ("say 'hello you' \"it is\"", ["say", "hello you", "it is"]),
        ("--name $(var robot)", ["--name", "r2"]),
        ("--name=$(var robot)x", ["--name=r2x"]),
        ("$(env NONE 'a b') c", ["a b", "c"]),
        ("'$(var robot) x' $(dirname)", ["r2 x", "/files"]),
        ("''", [""]),
    ],
)
def test_words_are_split_as_in_a_shell(text: str, meant: list[str]) -> None:
    """Quotes keep words together, and what a substitution gives is not split."""
    here = scope(launch_configurations={"robot": "r2"}, folder="/files")
    assert [resolve(each, here) for each in words(text)] == meant


def test_words_with_an_open_quote_are_an_error() -> None:
    """It says so."""
    with pytest.raises(LaunchError, match="'say \"hello' cannot be split into words: No closing quotation"):
        words('say "hello')


def test_the_substitutions_are_known() -> None:
    """All of ROS 2's common names are there."""
    assert {"var", "env", "dirname", "find-pkg-share", "command", "anon"} <= set(known_substitutions())


@given(st.text(alphabet=st.sampled_from("$()'\"\\ av\n"), max_size=40))
def test_any_text_is_read_or_refused(text: str) -> None:
    """Nothing else than a LaunchError comes of it; what has no $( keeps all but its backslashes."""
    try:
        made: Any = template(text)
    except LaunchError:
        assert "$(" in text
        return
    if "$(" not in text:
        assert isinstance(made, str)
        assert len(made) >= len(text) - text.count("\\")
    assert isinstance(made, str | Substitution | tuple)


@pytest.mark.parametrize("form", ["{}", "$(env {})", "$(env '{}')"])
def test_a_long_text_is_not_read_by_character(form: str) -> None:
    """Case 85: as many calls as for a short one; adding each character to a string would copy that."""
    template(form.format("x"))  # the first one of its form fills caches
    short, long = (form.format("x" * length) for length in (10, 10_000))
    assert calls_of(lambda: template(long)) == calls_of(lambda: template(short))
