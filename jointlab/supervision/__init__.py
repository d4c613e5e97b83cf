"""Driving the rig for others: one run at a time, its events, the operator's prompts, and who may drive."""
