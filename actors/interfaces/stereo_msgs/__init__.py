"""Interfaces of stereo_msgs."""
