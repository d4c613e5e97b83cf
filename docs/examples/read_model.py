"""Accelerances of a corrected simulation that Jointlab wrote: python read_model.py MODEL.h5 OUT.npz."""

import sys

import h5py
import numpy as np


def accelerances(path):
    """(rows, lines) in (m/s^2)/N and (lines,) Hz, computed from the matrices."""
    with h5py.File(path) as file:
        beam, parts, sensor, blows = ({k: v[()] for k, v in file[name].items()} for name in GROUPS)
        s, frequency = file["pole"][()], file["frequency"][()]
    mass, damping, stiffness = (beam[name][:, None] for name in ("mass", "damping", "stiffness"))
    g = 1 / (mass * s**2 + damping * s + stiffness * (1 + 1j * beam["loss_factor"]))  # (modes, lines)
    v, modes, found = sensor["modes"], parts["modes"], []
    between = np.einsum("an,nl,bn->lab", modes, g, modes)  # receptances of the free beam
    to_sensor = np.einsum("n,nl,an->la", v, g, modes)
    for w, state, added, reading in zip(blows["modes"], blows["state"], blows["added"], sensor["reading"], strict=True):
        d = parts["dynamic_stiffness"][state]
        free = np.einsum("an,nl,n->la", modes, g, w)
        motion = np.linalg.solve(np.eye(len(modes)) + between @ d, free[..., None])
        found.append(s**2 * reading * ((v * w) @ g - (to_sensor[:, None] @ d @ motion)[:, 0, 0] + added))
    return np.array(found), frequency


GROUPS = ("beam", "attached", "sensor", "blows")
if __name__ == "__main__":
    np.savez(sys.argv[2], **dict(zip(("accelerance", "frequency"), accelerances(sys.argv[1]), strict=True)))
