"""Before the test: which intervals a bench will give, what would narrow them, and the design studies of the paper."""
