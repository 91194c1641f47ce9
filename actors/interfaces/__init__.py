"""Message types: the standard packages, and the tools that define, parse and generate them."""
