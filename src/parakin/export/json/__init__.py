"""Results as objects for JSON: each result has one function ``encode_...``, in the module named after it.

Lengths are mm, angles degrees, times s; None stands for what does not exist.
"""
