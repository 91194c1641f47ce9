"""`callboard context`, and how other verbs follow it."""

from __future__ import annotations

import asyncio
import json
import os
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from actors.cli.broker_target import set_environment
from actors.cli.main import main
from actors.cli.parsing import Parser, add_broker_options
from actors.config.contexts import Contexts, contexts_file

if TYPE_CHECKING:
    from tests.actors.cli.conftest import Desk


@pytest.fixture(autouse=True)
def home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A configuration directory of the test's own, and no variable that says where to go."""
    for name in ("CALLBOARD_URL", "CALLBOARD_DOMAIN", "CALLBOARD_CONTEXT"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path))


def test_brokers_are_added_chosen_and_forgotten(capsys: pytest.CaptureFixture[str]) -> None:
    """What `list` shows follows; the default is always there."""
    robot = [
        "context",
        "add",
        "robot",
        "--url",
        "callboard://robot",
        "--domain",
        "3",
        "--description",
        "mine",
    ]
    assert main(robot) == 0
    assert capsys.readouterr().out == "Added 'robot'. To go there: callboard context use robot\n"
    assert main(["context", "use", "robot"]) == 0
    assert capsys.readouterr().out == "Commands and nodes go to callboard://robot from now on\n"
    assert main(["context", "list"]) == 0
    assert capsys.readouterr().out.splitlines() == [
        "   NAME     URL                         DOMAIN  DESCRIPTION",
        "   default  callboard://127.0.0.1:7411          callboard's default",
        "*  robot    callboard://robot                3  mine",
    ]
    assert main(["context", "show"]) == 0
    assert capsys.readouterr().out.splitlines() == [
        "url     callboard://robot:7411  context 'robot'",
        "domain  3                       context 'robot'",
    ]
    assert main(["context", "remove", "robot"]) == 0
    assert "from now on the context is 'default'" in capsys.readouterr().err
    assert Contexts.load() == Contexts()


def test_json_is_the_same(capsys: pytest.CaptureFixture[str]) -> None:
    """One document each."""
    assert main(["context", "add", "lab", "--url", "callboard://lab,callboard://b", "--use"]) == 0
    capsys.readouterr()
    assert main(["context", "list", "--json"]) == 0
    lab = {
        "name": "lab",
        "url": "callboard://lab,callboard://b",
        "domain": None,
        "description": "",
        **dict.fromkeys(("token_file", "ca", "cert", "key"), ""),
    }
    assert json.loads(capsys.readouterr().out)[1] == {**lab, "current": True}
    assert main(["context", "show", "lab", "--json"]) == 0
    assert capsys.readouterr().out == (
        '{"urls": ["callboard://lab:7411", "callboard://b:7411"], "domain": 0, '
        '"url_from": "context \'lab\'", "domain_from": "default"}\n'
    )


@pytest.mark.parametrize(
    ("arguments", "code", "text"),
    [
        ("context use robt", 1, "No context 'robt'; did you mean 'robot'?"),
        ("context remove zzz", 1, "No context 'zzz'; there is default, robot"),
        ("context show zzz", 1, "No context 'zzz'; there is default, robot"),
        ("topic list --context robt", 1, "No context 'robt'; did you mean 'robot'?"),
        ("context remove default", 1, "The context 'default' is always there"),
        (
            "context add robot --url callboard://a",
            1,
            "There is a context 'robot' already; --replace gives it another URL",
        ),
    ],
)
def test_what_is_wrong_is_one_line(
    arguments: str, code: int, text: str, capsys: pytest.CaptureFixture[str]
) -> None:
    """It says what helps; the file stays as it is."""
    main(["context", "add", "robot", "--url", "callboard://robot"])
    before = Path(contexts_file()).read_bytes()
    capsys.readouterr()
    assert main(arguments.split()) == code
    assert capsys.readouterr() == ("", f"{text}\n")
    assert Path(contexts_file()).read_bytes() == before


@pytest.mark.parametrize(
    ("variable", "value", "where"),
    [
        ("CALLBOARD_URL", "callboard://robot", "callboard://robot"),
        ("CALLBOARD_CONTEXT", "robot", "context 'robot'"),
    ],
)
@pytest.mark.parametrize(
    "command",
    [["use", "lab"], ["add", "lab", "--url", "callboard://b", "--replace", "--use"]],
    ids=["use", "add"],
)
def test_an_overridden_choice_does_not_claim_success(
    variable: str,
    value: str,
    where: str,
    command: list[str],
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Commands do not go there: what overrides it is named, and where they go instead."""
    main(["context", "add", "lab", "--url", "callboard://lab"])
    monkeypatch.setenv(variable, value)
    capsys.readouterr()
    assert main(["context", *command]) == 0
    assert capsys.readouterr() == (
        "The current context is 'lab'\n",
        f"{variable} overrides it: commands and nodes go to {where} until you unset {variable}\n",
    )


def test_a_variable_that_says_the_same_overrides_nothing(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """CALLBOARD_CONTEXT with the name that was chosen."""
    monkeypatch.setenv("CALLBOARD_CONTEXT", "default")
    main(["context", "use", "default"])
    assert capsys.readouterr() == ("Commands and nodes go to callboard://127.0.0.1:7411 from now on\n", "")


async def test_verbs_follow_a_context(desk: Desk, capsys: pytest.CaptureFixture[str]) -> None:
    """Named with --context or in use: commands with and without a node meet that broker and graph."""
    main(["context", "add", "desk", "--url", desk.url, "--domain", "4"])
    main(["context", "add", "nobody", "--url", "callboard+unix:///nowhere", "--use"])
    async with desk.node("fellow", domain=4) as fellow:
        fellow.create_service(_trigger(), "push", lambda request, response: response)
        await fellow.get_graph()  # the broker knows the node then
        capsys.readouterr()
        assert await asyncio.to_thread(main, ["node", "list", "--context", "desk"]) == 0
        assert capsys.readouterr().out == "/fellow\n"
        call = ["service", "call", "/push", "std_srvs/srv/Trigger", "--context", "desk"]
        assert await asyncio.to_thread(main, call) == 0
        assert await asyncio.to_thread(main, ["node", "list"]) == 3
        missing = "No broker at callboard+unix:///nowhere (context 'nobody')."
        assert capsys.readouterr().err.startswith(missing)


def test_children_get_the_options_of_run(monkeypatch: pytest.MonkeyPatch) -> None:
    """What a program that `run` starts hears is what was said to `run`, and nothing else."""
    main(["context", "add", "robot", "--url", "callboard://robot", "--domain", "3"])

    def told(*arguments: str) -> tuple[str | None, str | None]:
        monkeypatch.delenv("CALLBOARD_DOMAIN", raising=False)
        monkeypatch.setenv("CALLBOARD_URL", "callboard://there")
        parser = Parser()
        add_broker_options(parser)
        set_environment(parser.parse_args(arguments))
        return os.environ.get("CALLBOARD_URL"), os.environ.get("CALLBOARD_DOMAIN")

    assert told() == ("callboard://there", None)
    assert told("--domain", "2") == ("callboard://there", "2")
    assert told("--url", "callboard://a") == ("callboard://a:7411", None)
    assert told("--context", "robot") == ("callboard://robot:7411", "3")


def _trigger() -> type:
    from actors.interfaces.std_srvs.srv import Trigger  # noqa: PLC0415

    return Trigger
