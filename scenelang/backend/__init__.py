"""What draws: a trained network, or the exact definition."""
