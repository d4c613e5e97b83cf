"""Before the test: what a bench will tell, what would mend it, and how it lies to the paper's design studies."""
