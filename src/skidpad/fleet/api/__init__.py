"""The fleet's HTTP interface: who asks is found out first, then what they may, then which rows."""
