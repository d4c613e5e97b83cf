"""The gap diagnosis at work: from a measurement to a document, predictions and a report."""
