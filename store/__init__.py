"""The SQL catalogue, the waveforms beside it, and exchange with other people's files."""
