"""Services of example_interfaces."""

from actors.interfaces.example_interfaces.srv._add_two_ints import AddTwoInts as AddTwoInts
