"""From what was measured to k, h and gamma by both methods: the chain from records to stored results."""
