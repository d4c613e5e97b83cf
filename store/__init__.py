"""The SQL catalogue, the waveforms beside it, and exchange with other people's files.

Packages, each of which imports only those before it: `database`, `models`, `waveforms`, `measurements`, `results`,
`service`, `exchange`, `exports`, `backup`. `catalogue` opens all of it.
"""
