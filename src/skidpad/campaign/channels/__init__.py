"""Segments of routes that redundant channels drive: their world, the drive, what became of it."""
