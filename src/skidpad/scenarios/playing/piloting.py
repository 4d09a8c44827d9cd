"""Controllers of actors at work: along the lane by an acceleration, or with pedals and steer."""

from __future__ import annotations

from dataclasses import replace

from skidpad.core.states import VehicleCommand
from skidpad.scenarios.movement.tracking import track_demand
from skidpad.scenarios.scene import Actor, Controlling, Scene


def control(scene: Scene) -> None:
    """Steps every active controller; an action of the file goes before it in its domain.

    Sets the pedals of an actor whose controller has them, else its demanded speed.
    """
    for actor in scene.actors.values():
        actor.piloted, controller = None, actor.controller
        if controller is None or not actor.present:
            continue
        if controller.drives:
            actor.piloted = pilot(scene, actor, controller)
        elif actor.longitudinal is None and actor.controls[1]:
            guide = actor.guide
            v = max(guide.v + controller.acceleration(scene, actor.name) * scene.dt, 0.0)
            guide.v, guide.a = v, (v - guide.v) / scene.dt


def pilot(scene: Scene, actor: Actor, controller: Controlling) -> VehicleCommand | None:
    """Returns pedals by the controller, steer by the file, or the other way round, or both by one.

    None, with a notice, for an actor without pedals.
    """
    if actor.driver is None:
        scene.notice(f"{actor.name} has no pedals: its controller does nothing")
        return None
    asked = controller.command(scene, actor.name)
    lateral, longitudinal = actor.controls
    timed = actor.track is not None and actor.track.timed
    steers = lateral and actor.lateral is None and actor.track is None
    paces = longitudinal and actor.longitudinal is None and not timed
    if steers:
        actor.follow_road(scene.network, actor.guide.v)
    if paces:
        actor.guide.v, actor.guide.a = actor.motion.speed, 0.0
    if steers and paces:
        return asked
    if actor.track is not None:
        demand = track_demand(actor.track, actor.motion, scene.t, scene.dt, actor.centre)
    else:
        demand = actor.guide.demand(actor.motion)
    own = actor.driver.command(actor.motion, demand)
    if paces:
        return replace(asked, steer=own.steer)
    return replace(own, steer=asked.steer) if steers else own
