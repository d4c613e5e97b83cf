"""The ways in: command line, REST service and the technician's page."""
