"""Mapping beside a peer: the same frames into the map of this project and into an octree of voxels.

In: nothing, or a seed (argument 1). Out: ms per frame of OctoMap, three ways to insert, and of the map, from `cargo
bench`, in the same minutes, one thread. Needs Python with numpy and pyoctomap, and cargo.

    python3 bvm/benches/map_peers.py

The frames: a room of 6 x 5 x 3 m with up to six boxes, seen from its middle; along 360 x 90 directions (1 by 2 degrees),
cut at 2.5 m, voxels of 10 cm (ten cells of log-distance between 1 and 2.5 m are 10 to 22 cm deep); and by a camera of
640 x 480 pixels, 60 degrees wide, cut at 5 m, voxels of 5 cm (half a degree is 4.4 cm at 5 m).
"""
import os
import subprocess
import sys
import tempfile
import time

import numpy as np
import pyoctomap

SEED = int(sys.argv[1]) if len(sys.argv) > 1 else 1
RUNS = 5


def sphere():
    azimuth = np.radians(np.arange(360) + 0.5 - 180)
    elevation = np.radians(2 * np.arange(90) + 1.0 - 90)
    elevation, azimuth = np.meshgrid(elevation, azimuth, indexing="ij")
    across = np.cos(elevation)
    return np.stack([across * np.cos(azimuth), across * np.sin(azimuth), np.sin(elevation)], axis=-1).reshape(-1, 3)


def camera():
    up, left = np.meshgrid((239.5 - np.arange(480)) / 554.0, (319.5 - np.arange(640)) / 554.0, indexing="ij")
    rays = np.stack([np.ones_like(left), left, up], axis=-1).reshape(-1, 3)
    return rays / np.linalg.norm(rays, axis=1, keepdims=True)


def ranges(rays):
    random = np.random.default_rng(SEED)
    with np.errstate(divide="ignore"):
        inverse = 1.0 / rays
    room = np.array([2.5, 3.0, 1.5])  # ahead, left, up
    nearest = np.min(np.where(rays > 0, room, -room) * inverse, axis=1)
    for _ in range(6):
        size = random.uniform(0.2, 0.5, 3)
        middle = random.uniform(-1, 1, 3) * (room - size)
        middle[np.argmax(np.abs(middle))] += 1.2 * np.sign(middle[np.argmax(np.abs(middle))])
        if np.all(np.abs(middle) < size + 0.3):
            continue
        one, other = (middle - size) * inverse, (middle + size) * inverse
        enter, leave = np.minimum(one, other).max(axis=1), np.maximum(one, other).min(axis=1)
        hit = (enter > 0) & (enter <= leave)
        nearest = np.where(hit, np.minimum(nearest, enter), nearest)
    return nearest


def least(voxel, insert):
    times = []
    for _ in range(RUNS):
        tree = pyoctomap.OcTree(voxel)
        insert(tree)  # the first frame makes the nodes
        start = time.process_time()
        insert(tree)
        times.append(time.process_time() - start)
    return 1e3 * min(times)


def main():
    environment = dict(os.environ, ONLY="frames")
    with tempfile.TemporaryDirectory() as folder:
        for name, rays, farthest, voxel in [("sphere", sphere(), 2.5, 0.1), ("camera", camera(), 5.0, 0.05)]:
            distance = ranges(rays)
            points, origin = np.ascontiguousarray(rays * distance[:, None]), np.zeros(3)
            print(f"{name}: {len(rays)} rays, {np.mean(distance < farthest):.0%} shorter than {farthest} m; ms per frame")
            for how, options in [
                ("insert", {}),
                ("insert, discretized", dict(discretize=True)),
                ("insert, discretized, lazy", dict(discretize=True, lazy_eval=True)),
            ]:
                told = least(voxel, lambda tree: tree.insertPointCloud(points, origin, max_range=farthest, **options))
                print(f"  OctoMap, {100 * voxel:.0f} cm: {how:<28}{told:8.2f}")
            file = os.path.join(folder, name)
            np.where(distance < farthest, distance, np.inf).astype("<f4").tofile(file)
            environment[f"FRAME_{name.upper()}"] = file
        command = ["cargo", "bench", "-q", "-p", "bvm", "--bench", "kernels"]
        subprocess.run(command, env=environment, check=True)


main()
