"""KEEP_ALL's flow control at the node: credit with its windows, and the limits of a publisher's queue.

Imports proto, and the subscription for type checkers only.
"""
