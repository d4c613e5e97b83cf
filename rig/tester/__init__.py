"""The driver of the elastomer tester: its line, registers, status, limits, and how it is stopped."""
