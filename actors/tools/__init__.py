"""The parts of callboard's tools, for your own programs. Import each module by its name."""
