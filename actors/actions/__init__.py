"""Actions: goals that take time, with feedback, results and cancellation, over services and topics.

May import `endpoints` and what is below it.
"""
