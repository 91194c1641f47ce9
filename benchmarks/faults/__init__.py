"""What the resilience figures are made of: puppet processes, the measurements, and their tables."""
