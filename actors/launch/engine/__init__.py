"""What happens next in a launch, and making it happen: processes, nodes, restarts, waits, handlers.

Imports planning, description and `actors.processes`.
"""
