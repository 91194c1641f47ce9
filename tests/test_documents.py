"""Every snippet, command and link in the documents works."""

from __future__ import annotations

import ast
import os
import re
import shlex
import subprocess
import sys
import textwrap
from pathlib import Path
from pkgutil import resolve_name
from typing import TYPE_CHECKING

import pytest

from actors.launch.description.templates import known_substitutions
from actors.launch.documents.elements import ELEMENTS
from actors.launch.documents.reading import read_document
from tests.actors.site_packages import Site
from tests.fork_server.client import FORKED

if TYPE_CHECKING:
    from collections.abc import Mapping

ROOT = Path(__file__).resolve().parent.parent
README = (ROOT / "README.md").read_text(encoding="utf-8")
DOCUMENTS = (ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md")))
GROUPS = {"action", "auth", "bag", "bridge", "topic", "service", "node", "interface", "pkg", "context"}
"""First words of commands that have two."""


def document(path: str) -> str:
    """Return the text of a document in docs."""
    return (ROOT / "docs" / path).read_text(encoding="utf-8")


def run_python(
    *arguments: str, cwd: Path = ROOT, env: Mapping[str, str] = os.environ
) -> subprocess.CompletedProcess[str]:
    """Run Python with callboard on its path."""
    search_path = os.pathsep.join(filter(None, [str(ROOT), env.get("PYTHONPATH")]))
    return subprocess.run(
        [sys.executable, *arguments],
        executable=FORKED,
        cwd=cwd,
        env={**env, "PYTHONPATH": search_path},
        capture_output=True,
        text=True,
        check=False,
    )


def commands(text: str) -> list[str]:
    """Return the indented command lines of a document."""
    return re.findall(r"^    ((?:callboard|python|make|pip) .*)$", text, re.MULTILINE)


def test_the_readme_program_is_the_example() -> None:
    """The program on the first page does what examples/minimal_publisher.py does."""
    snippet = re.findall(r"```python\n(.*?)```", README, re.DOTALL)[0]

    def bodies(source: str) -> list[str]:
        tree = ast.parse(source)
        (cls,) = [node for node in tree.body if isinstance(node, ast.ClassDef)]
        return [ast.unparse(node) for node in cls.body if isinstance(node, ast.FunctionDef)]

    example = (ROOT / "examples" / "minimal_publisher.py").read_text(encoding="utf-8")
    assert bodies(snippet) == bodies(example)


def commands_by_verb() -> list[tuple[tuple[str, ...], list[str]]]:
    """Return the options that all documents show, by command."""
    verbs: dict[tuple[str, ...], set[str]] = {}
    for path in DOCUMENTS:
        for line in commands(path.read_text(encoding="utf-8")):
            program, *words = shlex.split(line.partition("--ros-args")[0])
            if program == "callboard":
                verb = tuple(words[: 2 if words[0] in GROUPS else 1])
                verbs.setdefault(verb, set()).update(word for word in words if word.startswith("-"))
    return sorted((verb, sorted(options)) for verb, options in verbs.items())


@pytest.mark.parametrize(("verb", "options"), commands_by_verb())
@pytest.mark.processes
def test_every_callboard_command_in_the_documents_exists(verb: tuple[str, ...], options: list[str]) -> None:
    """The verbs and options that the documents show are accepted by the command line."""
    done = run_python("-m", "actors", *verb, "--help")
    assert done.returncode == 0, done.stderr
    assert [option for option in options if option not in done.stdout] == []


def test_the_launches_in_the_readme_can_be_carried_out() -> None:
    """Each `callboard launch` command is planned from the repository's root."""
    lines = [line for line in commands(README) if line.startswith("callboard launch")]
    assert lines
    for line in lines:
        done = run_python("-m", "actors", *shlex.split(line)[1:], "--dry-run")
        assert done.returncode == 0, done.stderr
        assert "minimal_publisher" in done.stdout


@pytest.mark.processes
def test_the_program_about_diagnostics_runs() -> None:
    """It prints the rate of messages, the callback's durations, and the loop's lag."""
    text = document("how-to/diagnostics.md")
    program, _ = re.findall(r"```python\n(.*?)```", text, re.DOTALL)
    done = run_python("-c", program)
    assert done.returncode == 0, done.stderr
    assert re.fullmatch(
        r"\d+ messages/s, loop \d+% busy\nListener.on_message: \d+ calls, at most [\d.]+ ms in a row\n"
        r"loop late by [\d.]+ ms at worst in the last minute\n",
        done.stdout,
    )


@pytest.mark.processes
def test_the_program_about_the_broker_runs() -> None:
    """It prints the broker's traffic, and what is queued for each node."""
    text = document("how-to/diagnostics.md")
    _, program = re.findall(r"```python\n(.*?)```", text, re.DOTALL)
    done = run_python("-c", program)
    assert done.returncode == 0, done.stderr
    assert re.match(r"\d+ copies/s, [\d.]+ kB/s in\n", done.stdout)
    assert re.search(r"^/chatter: \d+ messages/s, 0 dropped$", done.stdout, re.MULTILINE)
    for node in ("/listener", "/talker"):
        assert f"{node}: 0 wait, 0 dropped, 0 calls owed\n" in done.stdout


def test_the_table_of_limits_matches_the_code() -> None:
    """Every constant in it exists, and its row shows the value."""
    text = document("how-to/diagnostics.md").partition("## Limits")[2]
    rows = [row for row in text.splitlines() if row.startswith("| ")][1:]
    named = 0
    for row in rows:
        limit, name = row.split("|")[2], row.split("|")[4].strip(" `")
        if name:
            place, _, constant = name.rpartition(".")
            where = resolve_name(place)  # a module, or the class of options with its defaults
            value = getattr(where() if isinstance(where, type) else where, constant)
            written = f"{value // 2**20} MiB" if constant.upper().endswith("BYTES") else f"{value:,}"
            assert re.search(rf"\b{written}\b", limit), row
            named += 1
    assert named > 8


@pytest.mark.processes
def test_the_picture_in_the_readme_is_up_to_date(tmp_path: Path) -> None:
    """After a change: python docs/pictures.py. Only names are compared, so that colours may change."""
    run_python(str(ROOT / "docs" / "pictures.py"), str(tmp_path / "graph.svg"))
    drawn = (tmp_path / "graph.svg").read_text(encoding="utf-8")
    names = re.findall(r">(/\w+)<", drawn)
    assert len(names) == 8
    assert re.findall(r">(/\w+)<", document("graph.svg")) == names


def test_the_pictures_of_the_page_are_small_and_shown() -> None:
    """Each is below 150 kB and has its place in a document; tests/browser/test_screenshots.py takes them."""
    pictures = set((ROOT / "docs" / "images").iterdir())
    assert pictures
    for picture in pictures:
        assert picture.read_bytes().startswith(b"\x89PNG")
        assert picture.stat().st_size < 150_000, picture
    assert pictures <= {file for path in DOCUMENTS for file, _ in links(path).values()}


def links(path: Path) -> dict[str, tuple[Path, str]]:
    """Return a document's relative links, each with the file and heading that it leads to."""
    text = re.sub(r"^```.*?^```$", "", path.read_text(encoding="utf-8"), flags=re.MULTILINE | re.DOTALL)
    found: dict[str, tuple[Path, str]] = {}
    for link in re.findall(r"\]\(([^)\s]+)\)", text):
        if "://" not in link:
            file, _, heading = link.partition("#")
            found[link] = ((path.parent / file).resolve() if file else path, heading)
    return found


def anchors(path: Path) -> set[str]:
    """Return GitHub's anchors for a document's headings."""
    headings = re.findall(r"^#+ (.+)$", path.read_text(encoding="utf-8"), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", each.lower()).replace(" ", "-") for each in headings}


@pytest.mark.parametrize("path", [*DOCUMENTS, ROOT / "ARCHITECTURE.md"], ids=lambda path: path.stem)
def test_every_link_in_the_documents_resolves(path: Path) -> None:
    """Each leads to an existing file, and to a heading in it."""
    for link, (file, heading) in links(path).items():
        assert file.exists(), link
        assert not heading or heading in anchors(file), link


def test_every_document_can_be_reached_from_the_readme() -> None:
    """The README links to the index, and the index to all others."""
    readme, index = ROOT / "README.md", ROOT / "docs" / "index.md"
    assert index in [file for file, _ in links(readme).values()]
    listed = {readme, index, *(file for file, _ in links(index).values())}
    assert [str(path) for path in DOCUMENTS if path not in listed] == []


@pytest.mark.parametrize("path", DOCUMENTS, ids=lambda path: path.stem)
def test_the_documents_import_only_public_paths(path: Path) -> None:
    """Modules below them may move at any time."""
    public = r"actors(\.bags|\.(interfaces|launch|testing|threads|tools)(\.\w+)*)?|broker"
    imports = r"^ *(?:from|import) ((?:actors|broker|proto)\b[\w.]*)"
    found = re.findall(imports, path.read_text(encoding="utf-8"), re.MULTILINE)
    assert [module for module in found if not re.fullmatch(public, module)] == []


def test_every_example_in_the_readme_exists() -> None:
    """Its commands start existing files."""
    names = {word for line in commands(README) for word in line.split() if word.startswith("examples/")}
    assert names
    assert [name for name in names if not (ROOT / name).exists()] == []


def test_the_guide_to_environment_variables_is_complete() -> None:
    """Its table has exactly the variables that the code reads."""
    names = r'"(CALLBOARD_[A-Z_]+|XDG_[A-Z_]+|[A-Z]+_COLOR|AMENT_[A-Z_]+|ROS_PYTHON_[A-Z_]+|ROS_DOMAIN_ID)"'
    sources = [path.read_text(encoding="utf-8") for path in (ROOT / "actors").rglob("*.py")]
    rows = re.findall(r"^\| `(\w+)`", document("how-to/environment.md"), re.MULTILINE)
    assert sorted(rows) == sorted({name for source in sources for name in re.findall(names, source)})


def test_every_make_target_in_the_documents_exists() -> None:
    """`make X` in README and CONTRIBUTING is a target."""
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
    text = README + (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")
    targets = set(re.findall(r"^    make ([\w-]+)", text, re.MULTILINE))
    assert {"demo", "test"} <= targets
    for target in targets:
        assert re.search(rf"^{target}:", makefile, re.MULTILINE), target


def test_make_demo_installs_what_the_demo_needs(tmp_path: Path) -> None:
    """A newcomer does not wait for linters and the tools of tests."""
    command = ["make", "--dry-run", f"VENV={tmp_path}", "demo"]
    # Not as a part of the make that runs the tests: it would print the folder, and share that one's options.
    environ = {name: value for name, value in os.environ.items() if not name.startswith(("MAKE", "MFLAGS"))}
    planned = subprocess.run(
        command, cwd=ROOT, env=environ, capture_output=True, text=True, check=True
    ).stdout
    assert re.findall(r"pip install .*--editable (\S+)", planned) == ["."]
    assert planned.rstrip().endswith("callboard demo")
    assert "pip install . && callboard demo" in README


def files_named_in(path: Path) -> set[str]:
    """Return the paths in backquotes in a document, outside of code blocks: "a/b.py", "b.py" or "a/"."""
    text = re.sub(r"^```.*?^```$", "", path.read_text(encoding="utf-8"), flags=re.MULTILINE | re.DOTALL)
    return set(
        re.findall(r"`((?:[\w.*-]+/)*[\w.*-]+\.(?:js|json|md|mjs|py|toml|yaml)|(?:[\w.*-]+/)+)`", text)
    )


def test_every_file_that_a_document_names_exists() -> None:
    """Below a folder of the repository; documents about the code may leave out the beginning of the path."""
    folders = [each for each in ROOT.iterdir() if each.is_dir() and each.name not in {"build", "dist"}]
    folders = [each for each in folders if not each.name.startswith(".")]
    paths = [
        f"/{file.relative_to(ROOT)}{'/' if file.is_dir() else ''}"
        for folder in folders
        for file in (folder, *folder.rglob("*"))
    ]
    tops = {each.name for each in folders} - {"callboard"}  # also the folder of a user's settings
    guides = (ROOT / "CONTRIBUTING.md", ROOT / "SECURITY.md", *(ROOT / "tests").rglob("*.md"))
    for path in (*DOCUMENTS, *guides, ROOT / "ARCHITECTURE.md"):
        about_code = path.name == "ARCHITECTURE.md" or "development" in path.parts
        for name in files_named_in(path):
            if name.split("/")[0] in tops:
                assert any(ROOT.glob(name)), f"{path.relative_to(ROOT)}: {name}"
            elif about_code:
                assert any(each.endswith(f"/{name}") for each in paths), f"{path.relative_to(ROOT)}: {name}"


def test_the_architecture_names_every_package() -> None:
    """ARCHITECTURE.md names every top-level package."""
    text = (ROOT / "ARCHITECTURE.md").read_text(encoding="utf-8")
    for package in ("proto", "broker", "actors", "callboard", "tests", "examples", "benchmarks"):
        assert f"`{package}/`" in text


@pytest.mark.processes
def test_the_programs_in_the_supervision_guide_run(tmp_path: Path) -> None:
    """The first program stops on SIGINT with 0; the second prints what is shown."""
    text = document("how-to/supervision.md")
    first, second = re.findall(r"```python\n(.*?)```", text, re.DOTALL)
    (shown,) = re.findall(r"```\n\n((?:    .*\n)+)", text)
    driver = """
        import os, signal, sys
        assert sys.argv[1:] == ["--port", "3"]
        os.kill(os.getppid(), signal.SIGINT)
    """
    (tmp_path / "driver.py").write_text(textwrap.dedent(driver), encoding="utf-8")
    for source, printed in ((first, ""), (second, textwrap.dedent(shown))):
        done = run_python("-c", source, cwd=tmp_path)
        assert (done.returncode, done.stdout) == (0, printed), done.stderr


@pytest.mark.processes
def test_the_programs_in_the_delivery_guide_print_what_it_shows() -> None:
    """Each program in docs/explanation/delivery.md prints the lines that follow it."""
    text = document("explanation/delivery.md")
    programs = re.findall(r"```python\n(.*?)```\n\n```text\n(.*?)```", text, re.DOTALL)
    assert len(programs) == 3
    # On a busy machine these imports hold the event loop for more than a second, which a warning says.
    early = "import actors.node.node, broker.server\n"
    for program, output in programs:
        done = run_python("-c", early + program)
        slow = [line for line in done.stderr.splitlines() if "held the event loop for" in line]
        assert (done.stdout, done.stderr.splitlines(), done.returncode) == (output, slow, 0)


@pytest.mark.processes
def test_the_command_line_guide_shows_what_is_printed(tmp_path: Path) -> None:
    """Each command is accepted; those about contexts print what is shown."""
    text = document("how-to/command-line.md")
    environ = {name: value for name, value in os.environ.items() if not name.startswith("CALLBOARD_")}
    environ |= {"XDG_CONFIG_HOME": str(tmp_path), "NO_COLOR": "1"}
    shown = re.findall(r"```text\n(.*?)```", text, re.DOTALL)[:2]
    for command in commands(text):
        words = shlex.split(command)[1:]
        if words[0] != "context":  # it would look for a broker
            words.append("--help")
        done = run_python("-m", "actors", *words, env=environ)
        assert done.returncode == 0, command
        if words[:2] in (["context", "list"], ["context", "show"]):
            assert done.stdout == shown.pop(0)
    assert not shown
    (program,) = re.findall(r"```python\n(.*?)```", text, re.DOTALL)
    environ["CALLBOARD_URL"] = "callboard+unix:///nowhere"
    done = run_python("-c", program, env=environ)
    assert "broker: No broker at callboard+unix:///nowhere (CALLBOARD_URL). Start one with" in done.stdout
    assert done.stdout.endswith("False\n")


@pytest.mark.processes
def test_the_launch_guide_shows_what_is_printed(tmp_path: Path) -> None:
    """Its files and commands are accepted; those that start nothing print what is shown."""
    text = document("how-to/launch.md")
    files = re.findall(r"```(?:python|yaml|toml)\n# (\S+)\n(.*?)```", text, re.DOTALL)
    assert len(files) == 5
    site = Site(tmp_path / "environment")
    scripts = [f"{name} = my_package.{name}:main" for name in ("talker", "listener")]
    site.install("my_package", scripts=scripts)
    (site.path / "my_package" / "launch").mkdir(parents=True)
    (site.path / "my_package" / "__init__.py").touch()
    for folder in (tmp_path, site.path / "my_package" / "launch"):
        for name, source in files:
            (folder / name).write_text(source, encoding="utf-8")
        (folder / "listener.py").touch()
    shown = re.findall(r"```text\n(.*?)```", text, re.DOTALL)
    assert len(shown) == 4
    for command in commands(text):
        starts = not command.endswith(("--show-args", "--dry-run"))
        done = run_python(
            "-m",
            "actors",
            *shlex.split(command)[1:],
            *(["--dry-run"] if starts else []),
            cwd=tmp_path,
            env=os.environ | {"PYTHONPATH": str(site.path)},
        )
        assert done.returncode == 0, done.stderr
        if not starts:
            assert done.stdout == shown.pop(0)
    assert not shown


def test_the_launch_guides_own_nodes_are_planned(tmp_path: Path) -> None:
    """Its file with node classes is accepted."""
    text = document("how-to/launch.md")
    (source,) = re.findall(r"```python\n([^#].*?node=Counter.*?)```", text, re.DOTALL)
    file = tmp_path / "own.launch.py"
    file.write_text(source, encoding="utf-8")
    done = run_python("-m", "actors", "launch", str(file), "--dry-run")
    assert done.stdout.splitlines() == [
        "[Counter-1] Counter --ros-args -r __ns:=/ns1",
        "[fast_counter-2] Counter --ros-args -r __node:=fast_counter -p step:=10",
    ], done.stderr


def test_the_launch_guide_lists_all_elements_and_substitutions() -> None:
    """Its YAML and TOML files describe the same launch."""
    text = document("how-to/launch.md")
    assert [each.names[0] for each in ELEMENTS if f"`{each.names[0]}`" not in text] == []
    assert [name for name in known_substitutions() if not re.search(rf"`\$\({name}[ )]", text)] == []
    files = re.findall(r"```(?:yaml|toml)\n# (\S+)\n(.*?)```", text, re.DOTALL)
    in_yaml, in_toml = (read_document(name, source.encode()) for name, source in files)
    assert in_yaml.actions == in_toml.actions


def test_the_program_in_the_launch_guide_prints_what_it_shows(tmp_path: Path) -> None:
    """The section about launches from programs has a program and its output."""
    text = document("how-to/launch.md")
    section = text.partition("## Launch from your own program")[2].partition("\n## ")[0]
    ((program, output),) = re.findall(r"```python\n(.*?)```\n\n```\n(.*?)```", section, re.DOTALL)
    environ = os.environ | {"CALLBOARD_URL": f"callboard+unix://{tmp_path}/broker"}
    done = run_python("-c", program, env=environ)
    assert (done.stdout, done.stderr, done.returncode) == (output, "", 0)
