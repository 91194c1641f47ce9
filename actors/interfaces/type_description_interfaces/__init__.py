"""Interfaces of type_description_interfaces."""
