"""Channels to blocks of samples: NI-DAQmx tasks, triggers, clocks, one record format."""
