"""The standalone broker: routes frames by topic and service name and knows who is there."""
