"""The beam on its joints: elements, joints and their assembly, and the modes and accelerances that follow."""
