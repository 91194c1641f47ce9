"""What a node has: publishers, subscriptions, services, clients and timers.

Imports session, callbacks and the packages of plain data below them.
"""
