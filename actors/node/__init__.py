"""The node: composes session, endpoints, graph and parameters, and starts and stops them.

Imports every package below it.
"""
