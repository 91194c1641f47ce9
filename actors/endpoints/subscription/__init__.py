"""A subscription: decoding, the queue of received batches, lost messages, liveliness.

Imports what `actors.endpoints` may.
"""
