"""Access control: users, roles and rules, and the credentials that identify a user.

Pure except `files.py`, which reads and replaces the file, and `transport.py`, which finds out where a
connection comes from. Imports proto, and `broker.access.private_file`.
"""
