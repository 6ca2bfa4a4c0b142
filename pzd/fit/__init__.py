"""The estimation core: the least squares that every fit of the package uses."""
