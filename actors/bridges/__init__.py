"""What bridges to other networks share: who is shown on the other side, with which QoS, what must not cross.

Everything directly in here is pure, but for the file that `options.py` reads; the packages in it are the
edges, one for each kind of network. It imports tools (suggestions), parameters (patterns), graph, interfaces
(errors), qos, time and proto.
"""
