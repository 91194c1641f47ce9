"""The fixtures as users get them: pytest runs of their own, in both modes of pytest-asyncio or without it."""

from __future__ import annotations

import importlib
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

pytestmark = pytest.mark.processes

pytest_plugins = ["pytester"]

ROOT = Path(__file__).parents[3]
OTHERS = ("hypothesispytest", "pytest_cov", "randomly", "timeout", "xdist", "xdist.looponfail")
"""Plugins that are installed here, and take longer to load than all else."""

USER_TESTS = """
import actors
import pytest
from actors.interfaces.std_msgs.msg import String

MARK

async def test_a_node_is_connected_to_the_broker(broker, node):
    assert node.connected
    assert await node.get_node_names() == ["test_node"]
    assert broker.stats().connections == 1

async def test_nodes_that_are_told_nothing_find_the_broker(node):
    async with actors.Node("mine", namespace="ns", connect_timeout_sec=20):
        assert await node.wait_for_node("/ns/mine", timeout_sec=20)

async def test_many_nodes_know_each_other(make_node):
    first = await make_node("first")
    second = await make_node("second", namespace="ns")
    assert second.get_namespace() == "/ns"
    assert set(await first.get_fully_qualified_node_names()) == {"/first", "/ns/second"}

async def test_a_name_that_is_taken_is_said_where_the_node_is_made(make_node):
    await make_node("same")
    with pytest.raises(actors.NodeNameTaken):
        await make_node("same")

async def test_nodes_go_through_the_proxy_that_are_told_so(node, make_node, fault_proxy):
    assert not fault_proxy.connections
    await make_node("far", url=fault_proxy.url)
    assert len(fault_proxy.connections) == 1
    fault_proxy.black_hole()  # and the end of the test does not wait for the node's goodbye

async def test_a_node_need_not_be_waited_for(make_node, fault_proxy):
    fault_proxy.refuse()
    far = await make_node("far", url=fault_proxy.url, connect_timeout_sec=None)
    await fault_proxy.wait_until(lambda: fault_proxy.refused > 0)
    assert not far.connected
"""


@pytest.fixture
def user(pytester: pytest.Pytester, monkeypatch: pytest.MonkeyPatch) -> pytest.Pytester:
    """A user with an environment that has its own ideas, and no broker that runs."""
    monkeypatch.setenv("PYTHONPATH", str(ROOT))
    monkeypatch.setenv("CALLBOARD_URL", "callboard://127.0.0.1:1")
    monkeypatch.setenv("CALLBOARD_DOMAIN", "no number")
    monkeypatch.setenv("ROS_DOMAIN_ID", "5")
    return pytester


def run(user: pytest.Pytester, *arguments: str) -> pytest.RunResult:
    """Run the user's tests with the plugin of this tree, whichever is installed."""
    without = [f"-pno:{name}" for name in ("callboard", "cacheprovider", *OTHERS)]
    return user.runpytest_subprocess(*without, "-p", "actors.testing.plugin", *arguments)


@pytest.mark.parametrize("mode", ["strict", "auto"])
def test_the_fixtures_work_in_both_modes(user: pytest.Pytester, mode: str) -> None:
    """Every fixture does what it says; a foreign environment disturbs none; nothing warns."""
    user.makeini(f"[pytest]\nasyncio_mode = {mode}\nasyncio_default_fixture_loop_scope = function\n")
    mark = "pytestmark = pytest.mark.asyncio" if mode == "strict" else ""
    user.makepyfile(USER_TESTS.replace("MARK", mark))
    run(user, "-W", "error").assert_outcomes(passed=USER_TESTS.count("async def test_"))


def test_the_options_of_the_broker_can_be_overridden(user: pytest.Pytester) -> None:
    """A fixture of the user's own decides; the environment is as before in the end."""
    user.makepyfile(
        """
        import os
        import pytest
        from broker import BrokerOptions

        @pytest.fixture
        def broker_options():
            return BrokerOptions(port=0, max_connections=7)

        @pytest.fixture(autouse=True)
        def unchanged():
            before = dict(os.environ)
            yield
            # pytest sets a variable of its own for each phase
            assert {**os.environ, "PYTEST_CURRENT_TEST": ""} == {**before, "PYTEST_CURRENT_TEST": ""}

        @pytest.mark.asyncio
        async def test_options(broker):
            assert broker.options.max_connections == 7
            assert os.environ["CALLBOARD_URL"] == broker.url
            assert "CALLBOARD_DOMAIN" not in os.environ
        """
    )
    run(user).assert_outcomes(passed=1)


@pytest.mark.parametrize("installed", [True, False])
def test_without_pytest_asyncio_other_tests_run_and_the_fixtures_say_what_is_missing(
    user: pytest.Pytester, *, installed: bool
) -> None:
    """The plugin breaks no run; only who asks for its fixtures gets an error, which names the remedy."""
    if not installed:
        user.makepyfile(pytest_asyncio="raise ImportError('not installed')")
    user.makepyfile(
        test_it="""
        def test_without():
            pass

        def test_with(node):
            pass
        """
    )
    result = run(user, "-p", "no:asyncio", "-W", "error")
    result.assert_outcomes(passed=1, errors=1)
    result.stdout.fnmatch_lines(["*need pytest-asyncio: pip install 'pytest-asyncio>=*' (*extra 'testing')*"])


def test_loading_the_plugin_loads_nothing_else_of_callboard() -> None:
    """It is loaded in every pytest run of everybody who has callboard installed."""
    code = (
        "import sys, actors.testing.plugin; "
        "print(sorted(m for m in sys.modules if m.split('.')[0] in {'actors', 'broker', 'proto', 'msgspec'}))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    own = ["actors", "actors.lazy", "actors.testing", "actors.testing.plugin"]
    assert done.stdout.strip() == str(own)


def test_the_distribution_registers_the_plugin_and_its_needs() -> None:
    """The entry point leads to the fixtures, and the extra that their error text names exists."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    assert project["entry-points"]["pytest11"] == {"callboard": "actors.testing.plugin"}
    module = importlib.import_module("actors.testing.plugin")
    for name in ("broker", "broker_options", "node", "make_node", "fault_proxy"):
        assert hasattr(module, name)
    assert {line.split(">")[0] for line in project["optional-dependencies"]["testing"]} == {
        "pytest",
        "pytest-asyncio",
    }
