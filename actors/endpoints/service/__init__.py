"""A service server and its queue of requests.

Imports what `actors.endpoints` may.
"""
