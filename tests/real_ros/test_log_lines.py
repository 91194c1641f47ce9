"""Log lines of the ROS face are those of real ROS 2, as the environment wants them."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from typing import Any

import pytest

from tests.real_ros import REAL_PYTHON, ROOT
from tests.real_ros.differences import agree
from tests.real_ros.sides import FOREIGN

COMMAND = ("-m", "tests.real_ros.programs.log_lines")
CASES: dict[str, dict[str, str]] = {
    "every name, on stdout": {
        "RCUTILS_CONSOLE_OUTPUT_FORMAT": "{severity}|{name}|{message}|{function_name}|{file_name}"
        "|{line_number}|{time}|{time_as_nanoseconds}|{date_time_with_ms}|{other}|{severity",
        "RCUTILS_LOGGING_USE_STDOUT": "1",
    },
    "colours": {"RCUTILS_COLORIZED_OUTPUT": "1"},
    "escapes, no colours": {
        "RCUTILS_CONSOLE_OUTPUT_FORMAT": r"{message}\t-\n{{name}}",
        "RCUTILS_COLORIZED_OUTPUT": "0",
        "RCUTILS_LOGGING_USE_STDOUT": "0",
    },
}


def printed(command: tuple[str, ...], environ: dict[str, str]) -> list[Any]:
    """Return what the program prints to stdout and stderr, without what differs from run to run."""
    own = {name: value for name, value in os.environ.items() if not name.startswith(FOREIGN)}
    ended = subprocess.run(
        command, cwd=ROOT, env={**own, **environ}, capture_output=True, text=True, timeout=60, check=True
    )
    # The escape that resets colours, which ROS 2 also prints before lines without one, is not visible.
    texts = (each.replace("\x1b[0m", "") for each in (ended.stdout, ended.stderr))
    return [re.sub(r"\d{4}-[-\d]+ [:.\d]+|\d{9,}(\.\d{9})?", "TIME", each) for each in texts]


@pytest.mark.parametrize("case", CASES)
def test_log_lines_are_those_of_ros(case: str, real_environ: dict[str, str], face_url: str) -> None:
    """They have the format, the colours and the stream that the variables say."""
    agree(
        "log line",
        case,
        real=printed((str(REAL_PYTHON), *COMMAND), {**real_environ, **CASES[case]}),
        callboard=printed(
            (sys.executable, "-m", "actors.ros", "--no-broker", *COMMAND),
            {"CALLBOARD_URL": face_url, **CASES[case]},
        ),
    )


@pytest.mark.parametrize("name", ["RCUTILS_COLORIZED_OUTPUT", "RCUTILS_LOGGING_USE_STDOUT"])
def test_other_values_are_refused(name: str, face_url: str) -> None:
    """The error names the variable. ROS 2 prints hundreds of lines of errors, and goes on."""
    with pytest.raises(subprocess.CalledProcessError) as failed:
        printed(
            (sys.executable, "-m", "actors.ros", "--no-broker", *COMMAND),
            {"CALLBOARD_URL": face_url, name: "yes"},
        )
    assert f"{name} must be 0 or 1, not 'yes'" in failed.value.stderr
