"""The verbs of `callboard`: a thin file for each, which reads arguments and calls what does the work."""
