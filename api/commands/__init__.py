"""The subcommands of `jointlab`, a file for each topic."""
