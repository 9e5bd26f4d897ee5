import mitex  # noqa: F401  (before torch, whose threads then wait as Mitex asks)
