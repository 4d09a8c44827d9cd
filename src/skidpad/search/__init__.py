"""Failure search and rare-event probability: where does a scenario fail, and how rare is that?

`space` says what varies, `trial` drives one choice of it, `methods` propose the next ones, `loop` goes
on until the budget is spent, `failures` looks at what was found, and `probability` says how rare it is.
"""
