"""Tables of a posted path and of a trajectory, as CSV and Parquet."""
