"""Judging drives of the matrix: metrics from the tick log, findings, acceptance. May use roads."""
