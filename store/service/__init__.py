"""Rows of the service: jobs, keys, alarms, requests, audit log and limits."""
