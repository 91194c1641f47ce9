"""What a bag consists of, as plain data: topics, QoS, and metadata.yaml.

No file is opened here. Imports the errors of bags, interfaces and the packages below them.
"""
