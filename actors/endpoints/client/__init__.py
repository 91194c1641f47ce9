"""A service client and its pending calls.

Imports what `actors.endpoints` may.
"""
