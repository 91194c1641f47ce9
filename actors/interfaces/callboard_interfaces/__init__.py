"""Interfaces of callboard_interfaces."""
