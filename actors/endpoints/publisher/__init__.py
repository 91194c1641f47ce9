"""A publisher, its queue and its QoS monitor.

Imports what `actors.endpoints` may.
"""
