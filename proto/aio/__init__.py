"""The asyncio layer that nodes and brokers share.

`channel` connects a socket to the pure protocol core, `tasks` restarts background tasks that fail, `process`
configures the event loop and the memory of callboard's own processes, `forks` keeps connections out of
forked children, and `toml_files` reads files of options.

May import the rest of `proto`; nobody but `broker` and `actors` imports it.
"""
