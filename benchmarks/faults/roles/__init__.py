"""What puppets play, one module a role: a coroutine function `play(parameters, director)`."""
