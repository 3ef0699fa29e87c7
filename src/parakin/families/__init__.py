"""Machines of one kind whose sizes are inputs, beside pose and joints."""
