"""Before the test: what a bench will tell, what would improve it, and how it compares with the design studies."""
