"""Playing: the node that publishes the messages of a bag.

Pure: `schedule.py` (when messages are due) and `playing_qos.py` (the QoS of the publishers). The thread of
`read_ahead.py` reads and converts the messages of `bag_source.py`; `played_service.py` turns recorded service
events into requests, which `service_requests.py` sends. `player.py` is the node, with the services of
`services.py`. Imports the reader and the contents of bags, the modules that the recorder uses, too, node
and the packages below it.
"""
