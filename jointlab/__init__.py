"""What a person, a sequence or a job can ask for: identification, diagnosis, trials, supervision of runs, reports."""
