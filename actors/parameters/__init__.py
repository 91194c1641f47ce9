"""The parameters of one node: types, values, overrides and errors.

Imports proto only.
"""
