"""The protocol rosbridge v2, for roslib, roslibpy and other clients: a session for each WebSocket.

Pure: `operations`, `fragments`, `topic_output`, `frames`, `cbor`, `values`, `type_definitions`. Imports the
rest of the package except `routes/` and `server.py`.
"""
