"""From a description to the steps of a launch, with every mistake found before anything starts. Pure.

Imports description.
"""
