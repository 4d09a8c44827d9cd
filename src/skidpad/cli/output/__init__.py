"""What commands print and write: tables, progress, JUnit, pictures."""
