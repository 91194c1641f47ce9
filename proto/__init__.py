"""The wire between nodes and brokers: names, limits, frames, codec and session, without any I/O."""
