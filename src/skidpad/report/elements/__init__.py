"""What every report is built of: the page, tables, figures, replays, verdicts, facts of a campaign."""
