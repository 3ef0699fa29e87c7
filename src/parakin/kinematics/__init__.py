"""The direct problem in all its forms, and joints along a path."""
