"""What bridges to other networks share: who is shown on the other side, with which QoS, what must not cross.

All modules directly in here are pure, except that `options.py` reads a file. The packages in it are the
edges, one for each kind of network. It imports parameters (patterns), graph, interfaces (errors), qos, time
and proto.
"""
