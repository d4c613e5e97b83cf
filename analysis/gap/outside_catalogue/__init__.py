"""Changes that are in no catalogue; they compete with the effects where the cause may be unknown."""
