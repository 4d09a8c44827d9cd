"""The reference driver: a careful human at the ego's wheel, who sees late and not everything."""
