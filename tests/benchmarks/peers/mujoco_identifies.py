"""MuJoCo's system identification: run by the Python of its own environment; prints what motions kept back leave.

usage: python mujoco_identifies.py ROBOT.urdf LOG.npz

Per joint stiffness and damping of a position servo, armature and friction loss are fitted to motions, all at once, as
``mujoco.sysid`` is used for a servo arm by its makers: 24 parameters of six joints. LOG.npz has ``joints``, the number
of ``motions``, which of these are ``held``, and of each k stamps and values of commands and readings: ``t.k``, ``u.k``,
``s.k``, ``q.k``. The answer is JSON: seconds, parameters, and rms in motions fitted and held, rad, by joint.
"""

from __future__ import annotations

import json
import sys
import time

import mujoco
import numpy as np
from mujoco import sysid

STEP = 5e-3
"""s: MuJoCo's time step, a quarter of the encoders'."""
NUMBERS = {
    "stiffness": (17.8, 1.0, 100.0),
    "damping": (0.6, 1e-3, 10.0),
    "armature": (0.028, 1e-4, 1.0),
    "frictionloss": (0.052, 1e-4, 1.0),
}
"""Start, of the public model of the arm, and least and largest value, SI."""
LIMIT = 3.35
"""N·m: largest torque of a servo, of the same model."""


def modifier(joint, number):
    """Return the function that puts a parameter into a model's specification."""

    def apply(spec, parameter):
        value = float(parameter.value[0])
        if number == "stiffness":
            sysid.apply_pgain(spec, joint, value)
        else:
            setattr(spec.joint(joint), number, value if number != "damping" else [value, 0.0, 0.0])

    return apply


def robot(urdf, joints):
    """Read the arm, without collisions, and give it servos and encoders."""
    spec = mujoco.MjSpec.from_file(urdf)
    for geom in spec.geoms:
        geom.contype = geom.conaffinity = 0
    spec.option.timestep, spec.option.integrator = STEP, mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    for name in joints:
        spec.joint(name).limited = False
        servo = spec.add_actuator(name=name, target=name, trntype=mujoco.mjtTrn.mjTRN_JOINT)
        servo.set_to_position(kp=NUMBERS["stiffness"][0])
        servo.forcelimited, servo.forcerange, servo.ctrllimited = True, (-LIMIT, LIMIT), False
        spec.add_sensor(
            name=f"{name}_read", type=mujoco.mjtSensor.mjSENS_JOINTPOS, objtype=mujoco.mjtObj.mjOBJ_JOINT, objname=name
        )
    return spec


def sequences(spec, log, names, joints):
    """Return the motions of a log as it wants them: commands held from stamp to stamp."""
    model, told = spec.compile(), []
    order = [model.joint(k).name for k in range(model.njnt)]
    for k in names:
        stamps, values = log[f"t.{k}"], log[f"u.{k}"]
        clock = np.arange(log[f"s.{k}"][0], log[f"s.{k}"][-1], STEP)
        held = values[np.clip(np.searchsorted(stamps, clock + 1e-9, side="right") - 1, 0, None)]
        control = sysid.TimeSeries.from_control_names(clock - clock[0], held, model, joints)
        read = sysid.TimeSeries.from_names(
            log[f"s.{k}"] - clock[0], log[f"q.{k}"], model, [f"{name}_read" for name in joints]
        )
        start = sysid.create_initial_state(model, log[f"q.{k}"][0][[joints.index(name) for name in order]])
        told.append(sysid.ModelSequences(str(k), spec, str(k), start, control, read))
    return told


def left(told, parameters):
    """Root mean square of what is left in each joint, rad, over motions."""
    _, predicted, read = sysid.residual(parameters.as_vector(), parameters, told)
    square, count = 0.0, 0
    for one, other in zip(predicted, read, strict=True):
        square = square + ((one[0].data - other[0].data) ** 2).sum(axis=0)
        count += len(one[0].data)
    return np.sqrt(square / count)


def main(urdf, path):
    """Fit the motions that are not held, and print what is left in all."""
    log = np.load(path)
    joints, held = [str(one) for one in log["joints"]], set(log["held"].tolist())
    spec, parameters = robot(urdf, joints), sysid.ParameterDict()
    for joint in joints:
        for number, (start, least, most) in NUMBERS.items():
            parameters.add(sysid.Parameter(f"{joint}.{number}", start, least, most, modifier=modifier(joint, number)))
    seen = sequences(spec, log, [k for k in range(int(log["motions"])) if k not in held], joints)
    unseen = sequences(spec, log, sorted(held), joints)
    before, begun = left(unseen, parameters), time.perf_counter()
    found, _ = sysid.optimize(parameters, sysid.build_residual_fn(models_sequences=seen), verbose=False, max_iters=30)
    seconds = time.perf_counter() - begun
    values = {name: float(found[name].value[0]) for name in found.keys()}
    answer = {"seconds": seconds, "before": before.tolist(), "parameters": values, "version": mujoco.__version__}
    print(json.dumps(answer | {"fitted": left(seen, found).tolist(), "held": left(unseen, found).tolist()}))


if __name__ == "__main__":
    main(*sys.argv[1:])
