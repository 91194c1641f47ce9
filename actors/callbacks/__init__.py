"""Running user code: one callback at a time per node, within a budget, timed.

Imports diagnostics only; knows neither links nor messages.
"""
