"""One module a subject: the six patterns and the three models that ship with the project."""
