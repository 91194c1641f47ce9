"""What can be done with a bag on the disk, without a broker: check, convert, export, reindex and recover.

Imports the reader and the writer of bags, and what these import.
"""
