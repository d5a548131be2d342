"""What a person writes about a search: read and checked, with all its faults reported together."""
