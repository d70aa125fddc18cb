"""What people do to logs, done to clean simulated trials."""
