"""Alarms: people are told of events that nobody watched. They inform; they do not protect anybody."""
