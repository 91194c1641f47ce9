"""The commands: a file for each, with its arguments and its action.

A command has EXAMPLES (command lines that `--help` shows, each with what it does), `add_arguments(parser)`
and `run(options) -> int`. Its top level imports only what reading arguments needs; `run`, and what it calls,
imports the rest.

May import everything; `actors.cli.table` loads a command by its name.
"""
