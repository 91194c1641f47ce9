"""The live view of `callboard top`. Needs textual; nothing else in callboard does."""
