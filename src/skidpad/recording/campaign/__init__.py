"""What campaigns and searches leave: the ledger, and one typed row per run."""
