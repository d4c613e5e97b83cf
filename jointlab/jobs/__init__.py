"""Jobs: long work in other processes. The state of a job is in the database."""
