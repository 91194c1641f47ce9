"""Access control: users, roles and rules, and the credentials that identify a user.

Pure except `files.py`, which reads the file, and `transport.py`, which asks a connection where it comes from.
Imports proto only.
"""
