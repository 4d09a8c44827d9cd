"""What things cost on this machine, and how background traffic gets along."""
