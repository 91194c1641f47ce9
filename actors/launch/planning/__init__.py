"""From a description to the steps of a launch, with every error found before anything starts. Pure.

Imports description.
"""
