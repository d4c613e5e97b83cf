"""What a rig does, shown to other programs by their protocols: it reads one service, and nothing can be commanded."""
