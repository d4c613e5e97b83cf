"""The elastomer tester: its line, registers, status and limits, how it is stopped, and a witness of its rest."""
