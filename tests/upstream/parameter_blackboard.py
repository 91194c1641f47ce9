"""A node that takes any parameter, in place of upstream's `parameter_blackboard`, which is written in C++."""

from __future__ import annotations

import actors

if __name__ == "__main__":
    actors.run(actors.Node("parameter_blackboard", allow_undeclared_parameters=True))
