"""What force protocols are made of: preparation, levels in an order, recovery."""
