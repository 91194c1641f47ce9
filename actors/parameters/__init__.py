"""The parameters of one node: types, values, overrides and errors.

Imports interfaces and proto.
"""
