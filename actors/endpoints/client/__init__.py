"""A service client, as users and as the runtime hold it, and its pending calls.

Imports what `actors.endpoints` may.
"""
