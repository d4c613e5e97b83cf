"""Alarms: messages to people about events that nobody watched. They inform; they protect nobody."""
