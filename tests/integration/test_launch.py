"""`callboard launch`: one command starts many processes and leaves none behind."""

from __future__ import annotations

import asyncio
import os
import re
import signal
import socket
import sys
import textwrap
from typing import TYPE_CHECKING, Final

import pytest

from actors.cli.errors import BROKEN_PIPE, OK
from actors.launch.engine.machine import REPEATED_STOP_SEC
from tests.actors.site_packages import Site
from tests.fork_server.client import FORKED
from tests.integration.conftest import DEADLINE_SEC, ROOT
from tests.integration.launch_files import launch_file, start_launch
from tests.integration.processes import DEAF, PARENT, SLEEPER, is_alive, pids_in, wait_until_dead

if TYPE_CHECKING:
    from pathlib import Path

    from tests.integration.conftest import System

pytestmark = pytest.mark.skipif(not hasattr(os, "killpg"), reason="needs process groups")

COURSE: Final = """
    from actors.launch import LaunchDescription, Node

    def generate_launch_description():
        return LaunchDescription([
            Node(
                package='py_pubsub',
                namespace='ns1',
                executable='my_publisher',
                name='my_publisher_node'
            ),
            Node(
                package='py_pubsub',
                namespace='ns1',
                executable='my_subscriber',
                name='my_subscriber_node'
            ),
        ])
"""

FLOOD: Final = """
import os, sys, time
line = b"x" * 199 + b"\\n"
for _ in range(5000):
    os.write(1, line)
    os.write(2, line)
os.write(1, b"flooded %d\\n" % os.getpid())
time.sleep(1000)
"""


async def test_the_courses_file_runs(system: System, tmp_path: Path) -> None:
    """Two nodes of a package in a namespace: labelled, on /ns1/addison, and stopped by Ctrl-C with 0."""
    site = Site(tmp_path / "environment")
    scripts = [f"my_{each} = py_pubsub.my_{each}:main" for each in ("publisher", "subscriber")]
    site.install("py_pubsub", scripts=scripts)
    package = site.path / "py_pubsub"
    (package / "launch").mkdir(parents=True)
    (package / "__init__.py").touch()
    (package / "launch" / "pubsub.launch.py").write_text(textwrap.dedent(COURSE))
    for each in ("publisher", "subscriber"):
        source = (ROOT / "examples" / f"minimal_{each}.py").read_text()
        main = f"def main():\n    callboard.run(Minimal{each.title()})\n"
        (package / f"my_{each}.py").write_text(source.partition("if __name__")[0] + main)
    environ = os.environ | {"PYTHONPATH": os.pathsep.join([str(ROOT), str(site.path)])}
    program = await system.program(
        sys.executable, "-m", "actors", "launch", "py_pubsub", "pubsub.launch.py", environ=environ
    )
    await program.wait_for_line(
        f"[INFO] [launch]: no broker at {system.url}: this launch starts one of its own"
    )
    await program.wait_for_line("[my_subscriber_node-2] ")
    received = await program.wait_for_line('[ns1.my_subscriber_node]: I heard: "Hi Automatic Addison: ')
    assert received.startswith("[my_subscriber_node-2] [INFO] [")
    topics = await system.python("-m", "actors", "topic", "list")
    assert await topics.wait_for_exit() == 0
    assert "/ns1/addison" in topics.lines
    pids = [int(each) for each in re.findall(r"process started with pid \[(\d+)\]", program.output)]
    assert len(pids) == 2
    assert await program.stop() == 0
    assert "Traceback" not in program.output
    assert program.output.count("process has finished cleanly [pid ") == 2
    await wait_until_dead(*pids)


async def test_a_running_broker_is_used(system: System, tmp_path: Path) -> None:
    """The launch starts no broker of its own, and ends with its only process."""
    await system.broker()
    tell = "import os; print('url', os.environ['CALLBOARD_URL'])"
    program = await start_launch(system, launch_file(tmp_path, "Node(script='tell.py')", tell=tell))
    assert await program.wait_for_exit() == 0
    assert f"[tell-1] url {system.url}" in program.lines
    assert "starts one of its own" not in program.output


@pytest.mark.parametrize("very", [False, True])
async def test_processes_that_ignore_signals_are_stopped(
    system: System, tmp_path: Path, *, very: bool
) -> None:
    """One that ignores SIGINT gets SIGTERM; one that ignores both gets SIGKILL."""
    more = "signal.signal(signal.SIGTERM, signal.SIG_IGN)" if very else ""
    file = launch_file(tmp_path, "Node(script='deaf.py')", deaf=DEAF.format(more=more))
    program = await start_launch(system, file)
    (pid,) = pids_in(await program.find_line("] deaf "))
    assert await program.stop() == 0
    assert not is_alive(pid)
    assert ("process has died [pid" in program.output) is very


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
async def test_signals_stop_everything(system: System, tmp_path: Path, number: signal.Signals) -> None:
    """Processes and their children end; the launch exits with 0."""
    if number is signal.SIGHUP and signal.getsignal(number) is signal.SIG_IGN:
        pytest.skip("these tests run under nohup")
    actions = "Node(script='parent.py')", "Node(script='sleeper.py')"
    program = await start_launch(system, launch_file(tmp_path, *actions, parent=PARENT, sleeper=SLEEPER))
    pids = [*pids_in(await program.find_line("] parent ")), *pids_in(await program.find_line("] sleeper "))]
    assert len(pids) == 3
    program.send_signal(number)
    assert await program.wait_for_exit() == 0
    await wait_until_dead(*pids)


async def test_output_of_python_programs_is_not_buffered(system: System, tmp_path: Path) -> None:
    """Their lines appear while they run, however they are started."""
    tell = str(tmp_path / "tell.py")
    actions = "Node(script='tell.py')", f"ExecuteProcess(cmd=[{sys.executable!r}, {tell!r}], name='other')"
    source = "import time; print('told', 0); time.sleep(1000)"
    program = await start_launch(system, launch_file(tmp_path, *actions, tell=source))
    for label in ("tell-1", "other-2"):
        await program.find_line(f"[{label}] told")
    assert await program.stop() == 0


async def test_a_second_signal_kills(system: System, tmp_path: Path) -> None:
    """A process that is slow to stop is killed at the second signal."""
    busy = DEAF.format(more='signal.signal(signal.SIGINT, lambda *_: os.write(1, b"asked\\n"))')
    file = launch_file(tmp_path, "Node(script='busy.py')", busy=busy)
    program = await start_launch(system, file, "--stop-timeout", "1000")
    (pid,) = pids_in(await program.find_line("] deaf "))
    program.send_signal(signal.SIGINT)
    await program.wait_for_line("] asked")
    ended = asyncio.create_task(program.wait_for_exit())
    while not ended.done():  # two that are close together are one
        program.send_signal(signal.SIGINT)
        await asyncio.wait({ended}, timeout=REPEATED_STOP_SEC)
    assert await ended == 0
    assert "process is killed" in program.output
    assert not is_alive(pid)


async def test_no_process_survives_a_killed_launch(system: System, tmp_path: Path) -> None:
    """After SIGKILL of the launch alone its processes and their children end."""
    actions = "Node(script='parent.py')", "Node(script='deaf.py')"
    program = await start_launch(
        system, launch_file(tmp_path, *actions, parent=PARENT, deaf=DEAF.format(more=""))
    )
    pids = [*pids_in(await program.find_line("] parent ")), *pids_in(await program.find_line("] deaf "))]
    program.send_signal(signal.SIGKILL)
    await wait_until_dead(*pids)


async def test_a_large_output_is_shown_completely(system: System, tmp_path: Path) -> None:
    """Each line of far more than a pipe holds is shown with its label."""
    program = await start_launch(system, launch_file(tmp_path, "Node(script='flood.py')", flood=FLOOD))
    (pid,) = pids_in(await program.find_line("] flooded "))
    assert sum(line == f"[flood-1] {'x' * 199}" for line in program.lines) == 10_000
    assert await program.stop() == 0
    assert not is_alive(pid)


async def test_a_launch_whose_output_is_not_read_can_be_stopped(system: System, tmp_path: Path) -> None:
    """A full stdout blocks neither the processes nor stopping them."""
    fifo = tmp_path / "flooded"
    os.mkfifo(fifo)
    flood = f"import os\nfifo = {str(fifo)!r}\n{FLOOD}".replace(
        'os.write(1, b"flooded %d\\n" % os.getpid())', "open(fifo, 'w').write(str(os.getpid()))"
    )
    file = launch_file(tmp_path, "Node(script='flood.py')", flood=flood)
    reading, writing = os.pipe()
    try:
        process = await asyncio.create_subprocess_exec(
            *(sys.executable, "-m", "actors", "launch", file, "--url", system.url),
            executable=FORKED,
            cwd=ROOT,
            stdout=writing,
            stdin=asyncio.subprocess.DEVNULL,
            start_new_session=True,
        )
        os.close(writing)
        async with asyncio.timeout(DEADLINE_SEC):
            pid = int(await asyncio.to_thread(fifo.read_text))
            process.send_signal(signal.SIGINT)
            assert await process.wait() == 0
    finally:
        os.close(reading)
    assert not is_alive(pid)


async def test_a_launch_stops_when_its_output_pipe_closes(system: System, tmp_path: Path) -> None:
    """`callboard launch … | head` ends like other programs, with its processes."""
    chatty = "import os, time\nwhile True:\n    os.write(1, b'pid %d\\n' % os.getpid())\n    time.sleep(0.01)"
    file = launch_file(tmp_path, "Node(script='chatty.py')", chatty=chatty)
    process = await asyncio.create_subprocess_exec(
        *("/bin/sh", "-c", '"$@" | sed -n "/ pid /{p;q;}"', "sh"),
        *(sys.executable, "-m", "actors", "launch", file, "--url", system.url),
        cwd=ROOT,
        stdout=asyncio.subprocess.PIPE,
        start_new_session=True,
    )
    async with asyncio.timeout(DEADLINE_SEC):
        out, _ = await process.communicate()
    (pid,) = pids_in(out.decode().partition(" pid ")[2])
    await wait_until_dead(pid)


async def test_a_launch_ends_with_its_last_process(system: System, tmp_path: Path) -> None:
    """Processes that fail at once are reported and fail the launch, although none was required."""
    actions = "Node(script='bad.py', name='bad')", "ExecuteProcess(cmd=['/no/such/command'])"
    program = await start_launch(system, launch_file(tmp_path, *actions, bad="raise SystemExit(7)"))
    assert await program.wait_for_exit() == 1
    assert re.search(
        r"^\[ERROR\] \[bad-1\]: process has died \[pid \d+, exit code 7, "
        r"cmd 'callboard run .*bad.py --ros-args -r __node:=bad'\]$",
        program.output,
        re.MULTILINE,
    )
    assert "[ERROR] [command-2]: process could not be run: no program '/no/such/command'" in program.lines


@pytest.mark.parametrize(
    ("code", "how"), [(3, "required=True"), (0, "required=True"), (3, "on_exit=Shutdown()")]
)
async def test_a_required_process_ends_the_launch(
    system: System, tmp_path: Path, code: int, how: str
) -> None:
    """The others are stopped; the launch fails if the process failed."""
    short = f"raise SystemExit({code})"
    # Python that is interrupted while it starts may exit with 1.
    actions = "ExecuteProcess(cmd=['sleep', '1000'], name='sleeper')", f"Node(script='short.py', {how})"
    program = await start_launch(system, launch_file(tmp_path, *actions, short=short))
    assert await program.wait_for_exit() == (1 if code else 0)
    assert "stopping: short-2 is required and has ended" in program.output
    (pid,) = re.findall(r"\[sleeper-1\]: process started with pid \[(\d+)\]", program.output)
    assert not is_alive(int(pid))


async def test_ctrl_c_ends_a_launch_with_0_after_a_failure(system: System, tmp_path: Path) -> None:
    """A failed process that was not required does not change the exit code."""
    actions = "Node(script='bad.py', name='bad')", "Node(script='sleeper.py')"
    file = launch_file(tmp_path, *actions, bad="raise SystemExit(7)", sleeper=SLEEPER)
    program = await start_launch(system, file)
    await program.wait_for_line("[bad-1]: process has died")
    pids_in(await program.find_line("] sleeper "))
    assert await program.stop() == 0


async def test_a_process_is_restarted(system: System, tmp_path: Path) -> None:
    """It is restarted up to its limit, each time with another pid."""
    action = "Node(script='short.py', respawn=True, respawn_max_retries=2)"
    program = await start_launch(system, launch_file(tmp_path, action, short="print('ran')"))
    assert await program.wait_for_exit() == 0
    assert program.lines.count("[short-1] ran") == 3
    assert len(set(re.findall(r"process started with pid \[(\d+)\]", program.output))) == 3


async def test_timers_arguments_and_the_environment_reach_processes(system: System, tmp_path: Path) -> None:
    """A timer's process starts later; the launch does not end before it."""
    actions = (
        "DeclareLaunchArgument('word')",
        "SetEnvironmentVariable('WORD', LaunchConfiguration('word'))",
        "TimerAction(period=0.01, actions=[Node(script='tell.py', arguments=['a b'])])",
        "LogInfo(msg=['word ', LaunchConfiguration('word')])",
    )
    tell = "import os, sys; print(os.environ['WORD'], sys.argv[1:])"
    program = await start_launch(system, launch_file(tmp_path, *actions, tell=tell), "word:=no", "word:=yes")
    assert await program.wait_for_exit() == 0
    first, second = (program.output.index(text) for text in ("[launch]: word yes", "[tell-1] yes ['a b']"))
    assert first < second


SERVER: Final = """
import actors
from actors.interfaces.example_interfaces.srv import AddTwoInts

class Server(actors.Node):
    def __init__(self):
        super().__init__("server")
        self.create_service(AddTwoInts, "add_two_ints", self.add)

    def add(self, request, response):
        response.sum = request.a + request.b
        return response

actors.run(Server)
"""

CLIENT: Final = """
import actors
from actors.interfaces.example_interfaces.srv import AddTwoInts

async def main():
    async with actors.Node("client") as node:
        client = node.create_client(AddTwoInts, "add_two_ints")
        assert await client.wait_for_service(timeout_sec=30)
        response = await client.call_async(AddTwoInts.Request(a=3, b=5), timeout_sec=30)
        print("Sum:", response.sum)

actors.run(main)
"""


async def test_a_process_waits_for_a_service(system: System, tmp_path: Path) -> None:
    """The client starts when the server in its namespace is available, although it is listed first."""
    actions = (
        "PushNamespace('ns1')",
        "Node(script='client.py', required=True, depends_on='service add_two_ints')",
        "RegisterEventHandler(OnServiceAvailable(service='add_two_ints', on_available=LogInfo(msg='seen ')))",
        "Node(script='server.py')",
    )
    program = await start_launch(system, launch_file(tmp_path, *actions, server=SERVER, client=CLIENT))
    assert await program.wait_for_exit() == 0
    texts = [
        "[client-1]: waits for service /ns1/add_two_ints",
        "[server-2]: process started",
        "[launch]: seen ",
        "[client-1] Sum: 8",
        "stopping: client-1 is required and has ended",
    ]
    places = [program.output.index(text) for text in texts]
    assert places == sorted(places)


async def test_a_dependency_that_does_not_appear_fails_the_process(system: System, tmp_path: Path) -> None:
    """After its timeout the required process counts as failed, and so does the launch."""
    action = "Node(script='tell.py', required=True, depends_on=['node talker'], depends_timeout=0.3)"
    program = await start_launch(system, launch_file(tmp_path, action, tell="print('told')"))
    assert await program.wait_for_exit() == 1
    assert "[tell-1]: process could not be run: node /talker was not there within 0.3 s" in program.output
    assert "told" not in program.output


async def test_handlers_react_to_output_and_exits(system: System, tmp_path: Path) -> None:
    """They start processes on output and on exit, and distinguish stdout and stderr."""
    (tmp_path / "functions.py").write_text("""
from actors.launch import LogInfo, Shutdown

def said(event):
    return LogInfo(msg=f"{event.process_name} said {event.text.decode().strip()} ")

def ended(event, context):
    return [LogInfo(msg=f"ended with {event.returncode} "), Shutdown(reason="enough")]
""")
    actions = (
        "RegisterEventHandler(OnProcessIO(target_action='first', on_stderr=said, handle_once=True))",
        "Node(script='first.py', name='first', on_exit=Node(script='second.py', on_exit=ended))",
        "Node(script='sleeper.py')",
    )
    file = launch_file(
        tmp_path,
        *actions,
        first="import sys; print('quiet'); print('loud', file=sys.stderr)",
        second="raise SystemExit(4)",
        sleeper=SLEEPER,
    )
    source = tmp_path / "file.launch.py"
    found = f"import sys\nsys.path.insert(0, {str(tmp_path)!r})\nfrom functions import ended, said\n"
    source.write_text(found + source.read_text())
    program = await start_launch(system, file)
    assert await program.wait_for_exit() == 1  # the second one's code was 4
    assert "[first-1] quiet" in program.output
    for text in ("first-1 said loud ", "ended with 4 ", "stopping: enough"):
        assert f"[INFO] [launch]: {text}" in program.output
    (pid,) = re.findall(r"\[sleeper-\d\]: process started with pid \[(\d+)\]", program.output)
    assert not is_alive(int(pid))


async def test_a_function_that_fails_ends_the_launch(system: System, tmp_path: Path) -> None:
    """It is reported in one line, and running processes are stopped."""
    actions = (
        "Node(script='sleeper.py')",
        "RegisterEventHandler(OnProcessIO(target_action='sleeper', on_output=lambda event: 1 / 0))",
    )
    program = await start_launch(system, launch_file(tmp_path, *actions, sleeper=SLEEPER))
    assert await program.wait_for_exit() == 1
    assert "<lambda>(): ZeroDivisionError: division by zero" in program.output
    assert program.output.count("ZeroDivisionError") == 1


async def test_a_process_has_its_own_stop_timeout(system: System, tmp_path: Path) -> None:
    """It takes precedence over the launch's, which is longer than this test."""
    action = "Node(script='deaf.py', sigterm_timeout='0.1', sigkill_timeout=1000)"
    file = launch_file(tmp_path, action, deaf=DEAF.format(more=""))
    program = await start_launch(system, file, "--stop-timeout", "1000")
    (pid,) = pids_in(await program.find_line("] deaf "))
    assert await program.stop() == 0
    assert "process has not ended after SIGINT; sending SIGTERM" in program.output
    assert not is_alive(pid)


async def test_two_signals_at_once_count_as_one(system: System, tmp_path: Path) -> None:
    """As sent by `timeout`: processes are asked to stop, not killed."""
    polite = """
import os, signal, time
def end(*_):
    os.write(1, b"good bye\\n")
    raise SystemExit
signal.signal(signal.SIGINT, end)
os.write(1, b"polite %d\\n" % os.getpid())
time.sleep(1000)
"""
    program = await start_launch(system, launch_file(tmp_path, "Node(script='polite.py')", polite=polite))
    pids_in(await program.find_line("] polite "))
    program.send_signal(signal.SIGINT)
    program.send_signal(signal.SIGTERM)
    assert await program.wait_for_exit() == 0
    assert "[polite-1] good bye" in program.output


async def test_a_port_of_another_program_is_reported(system: System, tmp_path: Path) -> None:
    """No broker can be started there and none answers, so no process is started."""
    with socket.create_server(("127.0.0.1", system.port)):  # connections wait there for ever
        program = await start_launch(
            system, launch_file(tmp_path, "Node(script='tell.py')", tell="print('told')")
        )
        assert await program.wait_for_exit() == 3
    assert f"{system.url}" in program.output
    assert "[tell-1]" not in program.output


async def test_a_closed_terminal_stops_everything(system: System, tmp_path: Path) -> None:
    """When the terminal closes, processes are asked to end, and none is left."""
    fifo, asked = tmp_path / "started", tmp_path / "asked"
    os.mkfifo(fifo)
    notes = f"""
import pathlib, signal
def note(*_):
    pathlib.Path({str(asked)!r}).touch()
    raise SystemExit
signal.signal(signal.SIGINT, note)
"""
    parent = notes + PARENT.replace("os.write(1, ", f"open({str(fifo)!r}, 'wb').write(")
    file = launch_file(tmp_path, "Node(script='parent.py')", parent=parent)
    window, terminal = os.openpty()
    process = await asyncio.create_subprocess_exec(
        *(sys.executable, "-m", "actors", "launch", file, "--url", system.url),
        cwd=ROOT,
        preexec_fn=lambda: os.login_tty(terminal),
    )
    os.close(terminal)
    try:
        async with asyncio.timeout(DEADLINE_SEC):
            started = await asyncio.to_thread(fifo.read_text)
            pids = pids_in(started)
            assert all(map(is_alive, pids))
            os.close(window)
            # It ends by itself; it may notice the closed terminal or the closed pipe first.
            assert await process.wait() in {OK, BROKEN_PIPE}
        await wait_until_dead(*pids)
        assert asked.exists()
    finally:
        if process.returncode is None:
            process.kill()
            await process.wait()


async def test_ctrl_c_after_a_required_process_failed_exits_with_1(system: System, tmp_path: Path) -> None:
    """The launch is stopping after the failure when Ctrl-C arrives."""
    busy = DEAF.format(more='signal.signal(signal.SIGINT, lambda *_: os.write(1, b"asked\\n"))')
    short = "Node(script='short.py', required=True)"
    actions = (
        f"RegisterEventHandler(OnProcessIO(target_action='deaf', handle_once=True, on_output={short}))",
        "Node(script='deaf.py')",
    )
    file = launch_file(tmp_path, *actions, deaf=busy, short="raise SystemExit(7)")
    program = await start_launch(system, file, "--stop-timeout", "1000")
    (pid,) = pids_in(await program.find_line("] deaf "))
    await program.wait_for_line("] asked")
    ended = asyncio.create_task(program.wait_for_exit())
    while not ended.done():
        program.send_signal(signal.SIGINT)
        await asyncio.wait({ended}, timeout=REPEATED_STOP_SEC)
    assert await ended == 1
    assert not is_alive(pid)


async def test_a_pipe_that_closes_while_a_launch_stops_kills_nothing(system: System, tmp_path: Path) -> None:
    """Ctrl-C in a pipeline ends the reader, too; the processes still clean up."""
    cleaned = tmp_path / "cleaned"
    slow = f"""
import os, signal, time
def end(*_):
    for count in range(100):
        os.write(1, b"cleaning %d\\n" % count)
        time.sleep(0.01)
    open({str(cleaned)!r}, "w").close()
    raise SystemExit
signal.signal(signal.SIGINT, end)
os.write(1, b"slow %d\\n" % os.getpid())
time.sleep(1000)
"""
    file = launch_file(tmp_path, "Node(script='slow.py')", slow=slow)
    reading, writing = os.pipe()
    process = await asyncio.create_subprocess_exec(
        *(sys.executable, "-m", "actors", "launch", file, "--url", system.url),
        executable=FORKED,
        cwd=ROOT,
        stdout=writing,
        start_new_session=True,
    )
    os.close(writing)
    async with asyncio.timeout(DEADLINE_SEC):
        with os.fdopen(reading) as lines:
            while "] slow " not in await asyncio.to_thread(lines.readline):
                pass
            process.send_signal(signal.SIGINT)
            while "] cleaning 40" not in await asyncio.to_thread(lines.readline):
                pass
        await process.wait()
    assert cleaned.exists()


async def test_a_launch_raises_the_limit_of_open_files(system: System, tmp_path: Path) -> None:
    """So that pidfds and pipes of many processes fit; its programs inherit the limit."""
    path = launch_file(tmp_path, "ExecuteProcess(cmd=['ulimit -S -n'], shell=True)")
    command = f'ulimit -S -n 256; exec "{sys.executable}" -m actors launch "{path}"'
    program = await system.program("/bin/sh", "-c", command, unbuffered=False)
    assert await program.wait_for_exit() == OK
    lines = [line for line in program.lines if line.startswith("[ulimit-1] ")]
    assert int(lines[0].split()[1]) > 256
