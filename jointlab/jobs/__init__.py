"""Jobs: work that takes its time, in other processes; what is true of a job is in SQL."""
