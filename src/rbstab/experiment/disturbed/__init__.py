"""What bounded disturbances do to a body: proved bounds, and loads that break them."""
