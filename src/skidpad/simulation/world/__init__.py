"""The moving world of a run, on which every simulator of the house stands.

`World(map, Lights(map), Conditions(...))` begins empty; `stage.build_world(setup, seed)` fills one.
Ids are given on entering and kept; rows of the arrays move when actors come and go.

Actors: `add`, `enter` (many, not yet present), `remove`, `reshape` (other physics), `row(id)`.
Control: `command`, `teleport` (velocity kept), `put` (by row, with speed), `set_velocity`, `walk`,
`push`, `twist`, `hold_velocity`, `set_simulated`, `set_collides`, `set_grounded`, `set_tyres`.
Conditions: `grip` (of `physics.grip.grip_params`), `zones` (boxes of other tire_friction),
`set_step`, and `lights` with `set_state`, `frozen`, `Group.frozen`, `Light.green|yellow|red`.
Time: `step(words)`, the words being a scenario's; `settle` after moving actors between steps.
Results: `states`, `fleet.wheels`, `grade`, `bank`, `mu` by row; `touching[:touches]`, all contacts
of the step with impulses, `obstacles.labels` naming the segments; `signs()`, limits and lights.
"""
