"""Alarms: somebody is told of what has happened while nobody looked. They inform; they protect nobody."""
