"""The roles of processes, one module each with a coroutine function `run(parameters, controller)`."""
