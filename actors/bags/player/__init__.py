"""Playing: the node that publishes what a bag has.

Pure: `schedule.py` (when which message is due) and `playing_qos.py` (what is offered). `read_ahead.py` has
the thread that reads and converts, `bag_source.py` what it reads; `player.py` is the node, with the services
of `services.py`. Imports the files of bags, the selection of the recorder, node and the packages below it.
"""
