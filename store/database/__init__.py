"""The database: connections, time limits, locks, columns and checksums of rows."""
