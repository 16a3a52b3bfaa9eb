"""Published experiments, simulated and repeated: the table and the figures of a paper."""
