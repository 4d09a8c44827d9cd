"""The kinds of campaigns: what a run is, how it is driven, which row comes back."""
