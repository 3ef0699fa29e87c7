"""The report of a tool path, one page of HTML."""
