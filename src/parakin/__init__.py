"""parakin: design, analyse and program parallel kinematic machine tools."""
