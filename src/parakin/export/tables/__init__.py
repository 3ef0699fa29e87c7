"""Tables of a posted path and of a law, as CSV and Parquet."""
