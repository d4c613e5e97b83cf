"""The REST service: `application.create_app` makes it, `resources` has one file for each resource."""
