"""The command line's reference as Markdown, from the parsers.

python -m actors.cli.reference > docs/reference/cli.md
"""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING, Final

from actors.cli.parsing import IGNORED, Parser, add_broker_options, add_ros_options, parser_of
from actors.cli.table import ELSEWHERE, VERBS, Verb, load

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping

_SHARED: Final = {"url", "domain", "context"}
"""The options of `add_broker_options`."""
_ROS: Final = {"spin_time", "no_daemon", "use_sim_time"}
"""The options of `add_ros_options`, as far as they change nothing."""

DIFFERENCES: Final = {
    "bag burst --storage-config-file": "It is left out: files are read as they are.",
    "bag convert -o": (
        "It is the folder of the new bag, whose settings are options. ROS 2 reads both from a YAML file."
    ),
    "bag play --storage-config-file": "It is left out: files are read as they are.",
    "bag record -s": "It writes MCAP files only: `sqlite3` is refused.",
    "bag record --max-cache-duration": "It is left out: `--max-cache-size` limits what a snapshot has.",
    "bag record --static-topics-path": "It is left out: named topics are awaited anyway.",
    "bag record --stats_max_publishing_rate": "It is left out: the bag says what was lost.",
    "bag record --storage-config-file": "It is left out: `--compression`, `--fsync` are what it would set.",
    "bag record --storage-preset-profile": "`fastwrite` is refused: many readers show its files as empty.",
    "launch NAME:=VALUE": "A file may be given alone, without a package in front of it.",
    "param set NAME": "Several pairs of a name and a value may follow each other.",
    "pkg create --build-type": "Packages are Python packages: `cmake` and `ament_cmake` are refused.",
    "pkg create --library-name": "It is refused: it makes a library of C++.",
    "run ARGS": "The program may be a Python file, and the words after it are its arguments.",
    "topic bw TOPIC": "Several topics may be measured at once.",
}
"""By a verb and one of its arguments or options, what is different from ROS 2's parser."""

_BEHAVIOUR: Final = {
    "`bag check`, `bag echo`, `bag recover`, `bag export`": "ROS 2 has no such verbs.",
    "`bag info`": (
        "It also takes a single file, and files whose end is missing. It prints how many messages were lost "
        "while callboard recorded. `-v` prints the bytes of topics only."
    ),
    "`bag list`": "It lists formats; callboard has no plugins.",
    "`bag play`": (
        "The node's name is `bag_player`. `-i BAG STORAGE` accepts the storage, but the files say what they "
        "are. Requests that find no server, and those that fail, are counted; each has the node's deadline, "
        "and playing ends when all are answered. The calls of actions are published as events. `~/seek` "
        "fails for a time outside the bag; ROS 2 goes to the beginning, or beyond the end. The keys change "
        "the rate by a tenth of itself instead of by 0.1."
    ),
    "`bag reindex`": "It reads files whose end is missing up to the last whole chunk, and names them.",
    "`bag record`": (
        "The node's name is `bag_recorder`. `--compression` is callboard's; `--compression-mode file` and "
        "`message` compress messages in chunks, too, so that all readers of MCAP can read them. Each file "
        "starts with the latched messages. A named topic need not exist yet: its first message is "
        "recorded. 10,000 messages of a topic may wait rather than 10. There is no `~/record`: the command "
        "ends with `~/stop`. The services have Kilted's types; in ROS 2's next version `~/resume`, "
        "`~/split_bagfile` and `~/stop` have more fields, and so other type hashes: its clients do not "
        "match. `~/get_report` says what was lost, instead of its topic `events/rosbag2_messages_lost`."
    ),
    "all verbs": (
        "Options cannot be abbreviated (`--trunc` for `--truncate-length`). Exit codes tell failures apart, "
        "as above; ROS 2's are 0, 1 and 2, and 0 also if a parameter could not be set."
    ),
    "`doctor --report`": "It prints all checks of callboard: there are no reports about ROS 2.",
    "`doctor hello`": "The table has no part about multicast, and counts other processes of this host, too.",
    "`param describe`": "Unknown names do not hide the known ones.",
    "`service list`": "It lists services that have a server. ROS 2 lists those of clients, too.",
    "`param`": "`--timeout` is 5 s by default instead of 1 s, and may be a fraction of a second.",
    "`service call --stdin`, `topic pub --stdin`, `action send_goal --stdin`": (
        "Each document is used as it comes. ROS 2 reads stdin to its end, as one."
    ),
    "`topic echo --field`": "Arrays are printed as lists. ROS 2 prints NumPy's arrays.",
    "`topic echo --filter`": "`m` is the message, also with `--field`. In ROS 2 it is the field then.",
    "`topic echo --flow-style`": (
        "Each message is one line in braces. ROS 2 puts only its sequences in one line each."
    ),
    "`topic info -v`": "`GID` is the broker's number, and `Strict` says how QoS is compared.",
    "`topic echo`, `topic pub`": (
        "The policies `unknown` and `best_available` leave the choice to callboard, which takes what fits "
        "the other endpoints. ROS 2 fails with `unknown`."
    ),
    "`topic hz`, `topic bw`": (
        "They read the broker's counters, and subscribe only with `--subscribe`, `--once` (`hz`), `--filter` "
        "or `--use-sim-time`; without a subscription there are no gaps and no sizes of single messages."
    ),
    "`topic pub`": (
        "If it would wait for subscriptions, and the topic has another type, it ends at once with 1. "
        "`--keep-alive` is 0 by default: it waits until all messages are sent."
    ),
}
"""By verbs, what is different from what ROS 2's verbs do with the same words."""

_HEAD: Final = """\
# The command line

Generated from the parsers; `callboard VERB --help` prints the same.

- Data goes to stdout, everything else to stderr. `--json` prints one document, or one per line where there is
  no end ([the shapes](json.md)).
- Exit codes: 0 done, 1 failed, 2 wrong usage, 3 no broker that can be used (none answers, it refuses the
  credentials, TLS fails, or a token or TLS file cannot be used), 124 timeout, 130 and 143 stopped by SIGINT
  and SIGTERM (0 for `broker`, `run`, `launch` and `demo`, which run until they are stopped; in the live `top`
  Ctrl-C is a key like `q`, and ends with 0).
- Colours appear on a terminal only; `NO_COLOR` and `FORCE_COLOR` decide otherwise.
"""


def reference() -> str:
    """Return the reference as Markdown."""
    parts = [_HEAD, _contents(), _broker_options(), _ros_options(), _ros_words()]
    for name, entry in VERBS.items():
        if isinstance(entry, Verb):
            parts.append(_verb(name, entry, "##"))
        else:
            parts.append(f"## callboard {name}\n\n{_sentence(entry.summary)}\n")
        parts += [_verb(f"{name} {verb}", each, "###") for verb, each in entry.verbs.items()]
    return "\n".join(parts)


def _contents() -> str:
    rows = ["| | |", "|---|---|"]
    for name, entry in VERBS.items():
        verbs = ", ".join(map(_code, entry.verbs))
        rows.append(f"| [`callboard {name}`](#callboard-{name}) | {entry.summary}{verbs and ': '}{verbs} |")
    return "\n".join(rows) + "\n"


def _broker_options() -> str:
    parser = Parser()
    add_broker_options(parser)
    rows = _table(each for each in parser._actions if each.dest != "help")  # noqa: SLF001
    return "\n".join(["## The broker", "", "Verbs that need a broker have these, too:", "", *rows])


def _ros_options() -> str:
    parser = Parser()
    add_ros_options(parser)
    rows = _table(each for each in parser._actions if each.dest != "help")  # noqa: SLF001
    about = "Verbs that wait for discovery in ROS 2 have its options for it:"
    return "\n".join(["## Options of ROS 2's discovery", "", about, "", *rows])


def _ros_words() -> str:
    rows = [f"| {_code(f'ros2 {word}')} | {_cell(text)} |" for word, text in ELSEWHERE.items()]
    about = "These words of the `ros2` command are no verbs here, and say so. `wtf` is `doctor`."
    instead = ["## Words of ROS 2", "", about, "", "| command | instead |", "|---|---|", *rows, ""]
    rows = [f"| {verbs} | {_cell(text)} |" for verbs, text in _BEHAVIOUR.items()]
    rows += [f"| {_code(words)} | {_cell(text)} |" for words, text in DIFFERENCES.items()]
    about = "Verbs, options and arguments are those of `ros2`, and more, except for these differences:"
    return "\n".join(
        [*instead, "## Differences from ROS 2", "", about, "", "| verb | here |", "|---|---|", *rows, ""]
    )


def _verb(command: str, verb: Verb, level: str) -> str:
    module, parser = load(command), parser_of(command, verb)
    lines = [f"{level} callboard {command}", "", _sentence(verb.summary), "", *_examples(module.EXAMPLES)]
    # argparse offers no other way to see its arguments than the text of --help, which is each version's own.
    actions = [each for each in parser._actions if each.help != argparse.SUPPRESS]  # noqa: SLF001
    shared = {each.dest for each in actions} & _SHARED if command != "broker" else set[str]()
    ros = {each.dest for each in actions if each.dest in _ROS and str(each.help).startswith(IGNORED)}
    own = [each for each in actions if each.dest not in {"help", *shared, *ros}]
    lines += _table(own)
    links = ["for [the broker](#the-broker)"] * bool(shared)
    links += ["of [ROS 2's discovery](#options-of-ros-2s-discovery)"] * bool(ros)
    if links:
        lines += [f"It has the options {' and '.join(links)}.", ""]
    return "\n".join(lines)


def _examples(examples: Mapping[str, str]) -> Iterator[str]:
    for line, what in examples.items():
        yield from (f"- {_sentence(what)}", "", f"      {line}", "")


def _table(actions: Iterable[argparse.Action]) -> list[str]:
    rows = [f"| {_shown(each)} | {_cell(str(each.help) % vars(each))} |" for each in actions]
    return ["| argument | |", "|---|---|", *rows, ""] if rows else []


def _shown(action: argparse.Action) -> str:
    value = _value(action)
    if not action.option_strings:
        return _code(f"[{value}]" if action.nargs in {"?", "*", "..."} else value)
    return ", ".join(_code(f"{option} {value}".rstrip()) for option in action.option_strings)


def _value(action: argparse.Action) -> str:
    if action.nargs == 0:
        return ""
    if action.metavar is None and action.choices is not None:
        return "|".join(map(str, action.choices))
    name = action.metavar if isinstance(action.metavar, str) else action.dest.upper()
    return f"{name}..." if action.nargs in {"*", "+", "..."} else name


def _code(text: str) -> str:
    return f"`{_cell(text)}`"


def _cell(text: str) -> str:
    return text.replace("|", "\\|").replace("\n", " ")


def _sentence(text: str) -> str:
    return f"{text[0].upper()}{text[1:]}."


if __name__ == "__main__":
    print(reference(), end="")
