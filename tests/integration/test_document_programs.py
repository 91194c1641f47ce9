"""Programs and tests of the documents that start several processes."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

from tests.test_documents import README, document, run_python

if TYPE_CHECKING:
    from pathlib import Path


def test_the_programs_in_the_readme_work_together(tmp_path: Path) -> None:
    """The node with its own types, the program that embeds it, and its test run as shown."""
    for name, source in re.findall(r"```python\n# (\w+\.py)\n(.*?)```", README, re.DOTALL):
        (tmp_path / name).write_text(source, encoding="utf-8")
    (shown,) = re.findall(r"```text\n(.*?)```", README, re.DOTALL)
    plugin = ["-p", "no:callboard", "-p", "actors.testing.plugin"]  # this one, whichever is installed
    for command, printed in ((["house.py"], shown), (["-m", "pytest", "-q", *plugin], "1 passed")):
        done = run_python(*command, cwd=tmp_path)
        assert done.returncode == 0, done.stdout + done.stderr
        assert printed in done.stdout


def test_the_tests_in_the_testing_guide_pass(tmp_path: Path) -> None:
    """The files in docs/how-to/test.md form a project whose tests pass without warnings."""
    text = document("how-to/test.md")
    files = re.findall(r"```python\n# (\w+\.py)\n(.*?)```", text, re.DOTALL)
    files += [("pyproject.toml", block) for block in re.findall(r"```toml\n(.*?)```", text, re.DOTALL)]
    names = {"pyproject.toml", "adder.py", "conftest.py", "test_faults.py", "test_programs.py"}
    assert names <= {name for name, _ in files}
    tests = tmp_path / "tests"
    tests.mkdir()
    for name, content in files:
        folder = tmp_path if name == "pyproject.toml" else tests
        (folder / name).write_text(content, encoding="utf-8")
    plugin = ["-p", "no:callboard", "-p", "actors.testing.plugin"]  # this one, whichever is installed
    done = run_python("-m", "pytest", *plugin, "-W", "error", "-p", "no:cacheprovider", cwd=tmp_path)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "6 passed" in done.stdout
