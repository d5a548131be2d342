"""What a person writes about a search: read, checked, its faults told together."""
