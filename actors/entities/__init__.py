"""What a node has: publishers, subscriptions, services, clients and timers."""
