"""The ways in: REST, command line and report."""
