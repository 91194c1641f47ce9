"""The broker as a program: its options from files and argv, its signals, and systemd.

May import everything in `broker` and `proto`.
"""
