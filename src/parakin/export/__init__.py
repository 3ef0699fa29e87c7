"""What people and other programs read: pictures, pages, tables, JSON. Functions of results; only ``files`` writes."""
