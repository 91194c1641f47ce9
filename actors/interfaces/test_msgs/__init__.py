"""Interfaces of test_msgs."""
