"""Checks of the rig before it measures: channels, tester, and instruments of other makers."""
