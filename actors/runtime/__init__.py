"""What a script needs around its nodes: `actors.run`, signals, log output, the tasks that remain at the end.

Imports config, node and the packages below.
"""
