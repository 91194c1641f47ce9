"""The `callboard` command line.

The top layer of `actors`: may import everything.
"""
