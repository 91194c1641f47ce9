"""The single files of a bag: MCAP files, which are written and read, and SQLite files, which are read.

`bag_file.py` has the protocol that all readers of files follow. Only the modules beside it import the
libraries of the extra `bags`, so import them where a file is opened and not at the top of a module. Imports
the contents and the errors of bags.
"""
