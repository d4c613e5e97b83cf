"""Joints from the tester: sine fits, dynamic stiffness, corrections, cylinder terms and a law of the elastomer."""
