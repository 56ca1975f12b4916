"""What registration, odometry, finding and recurrences share: how surfaces lie on each other, how sure."""
