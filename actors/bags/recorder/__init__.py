"""Recording: the node that writes messages of a graph into a bag.

Pure: `recording_qos.py` (the QoS of its subscriptions), `losses.py` (counts of messages that are not in the
bag) and `buffers.py` (messages that wait). `topic_follower.py` subscribes, `message_collector.py` takes
messages, and the thread of `writer_thread.py` writes them; `recorder.py` is the node, with the services of
`services.py`. Imports the writer and the contents of bags, the modules that the player uses, too, node and
the packages below it.
"""
