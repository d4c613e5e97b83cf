"""Backup, restoration and check of a catalogue with its waveforms."""
