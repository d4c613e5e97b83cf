"""The simulated hardware: the physics of the bench, and three instruments on their real wires."""
