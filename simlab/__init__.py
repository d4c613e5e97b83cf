"""What stands in for hardware: the physics of the bench, and three instruments on their real wires."""
