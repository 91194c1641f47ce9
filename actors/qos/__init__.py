"""QoS profiles, and the rules by which a publisher and a subscription are compatible.

Plain data: imports time and proto only.
"""
