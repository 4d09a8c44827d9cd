"""Report: tables, figures, verdicts and the page."""
