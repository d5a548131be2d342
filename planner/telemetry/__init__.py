"""What an aircraft tells of its flight: recorded tracks, read and put onto the target's clock."""
