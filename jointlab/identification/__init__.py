"""Identification of k, h and gamma by both methods: from records to stored results."""
