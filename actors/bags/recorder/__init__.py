"""Recording: the node that writes what a graph carries into a bag.

Pure: `selection.py` (which topics), `recording_qos.py` (how to subscribe to them), `losses.py` (what did not
reach the bag). `write_queue.py` holds what waits for the thread of `writer_thread.py`; `recorder.py` is the
node, with the services of `services.py`. Imports the files of bags, node and the packages below it.
"""
