"""Dimensional synthesis: sizes of machines from what they must do, searched for globally and then proved."""
