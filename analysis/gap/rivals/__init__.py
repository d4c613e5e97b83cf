"""Changes that no effect of the catalogue makes; they compete with it where the cause may be unknown."""
