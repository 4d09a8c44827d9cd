"""The baseline in words: with no driver at the pedals a run measures how often the car is put back."""

from __future__ import annotations

from skidpad.core.wording import count_text
from skidpad.report.elements.page import Block, Text
from skidpad.report.matrix.data import BASELINE, FIRST, INTERVENTIONS, Matrix


def baseline_text(matrix: Matrix) -> list[Block]:
    """What configuration 0 is, and why it stands in no comparison (decision T-5)."""
    if matrix.comparison_configs == matrix.configs:
        return []
    runs = matrix.cell(BASELINE).drop_nulls([INTERVENTIONS, "duration_s"])
    events = int(runs[INTERVENTIONS].sum())
    text = "Configuration 0 has nobody at the pedals: it aims for 150 km/h and never brakes. "
    first = runs[FIRST].drop_nulls()
    if events and len(first):
        cycle = float(runs["duration_s"].sum()) / events
        text += (
            f"It was put back on the road every {cycle:.0f} s, the first time after "
            f"{float(first.median()):.0f} s in the median of {count_text(len(runs), 'drive')}. "  # type: ignore[arg-type]
        )
    text += (
        "Its counts measure this cycle and not the weather. They stand in the tables as they were, "
        "and in no total, and in no comparison or figure but those of the sources' own claims and numbers."
    )
    return [Text(text, tone="note")]
