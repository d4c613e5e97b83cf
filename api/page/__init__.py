"""The technician's page: sees what the rig does, drives it, and shows what came of it. Nothing comes from outside."""
