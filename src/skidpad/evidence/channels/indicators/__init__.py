"""Safety performance indicators over channel frames."""
