"""The parts of callboard's tools, for your own programs. Import each module by its name.

Imports node, graph, actions and the packages below them.
"""
