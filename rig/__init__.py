"""What the laboratory does, and the instruments that it drives.

Packages, each of which imports only those before it: `tester`, `sequences`, `hammer`, `sweep`, `runs`, `checks`.
"""
