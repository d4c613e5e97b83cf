"""What the laboratory does, in order: hammer session, sweep and other sequences, and the instruments they drive."""
