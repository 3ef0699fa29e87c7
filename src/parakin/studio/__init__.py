"""The studio: a page in the browser with every command behind it, on this computer only."""
