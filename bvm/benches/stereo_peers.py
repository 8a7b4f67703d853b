"""Stereo beside its peers: `bvm look` and OpenCV on the same pairs, the same pixels, one thread.

In: the folder of recordings (argument 1, or $BP_DATA), and a built `bvm` (argument 2, or target/release/bvm).
Out: a table of bad pixels, density and CPU time, and what is wrong among the surest (sparsification), for both
matchers of `bvm` and for StereoBM and StereoSGBM. Needs Python with numpy and opencv.

    python3 bvm/benches/stereo_peers.py ../shared/data target/release/bvm

Pixels that count have a true disparity and are seen by the right camera: by the published mask (cones), or by a
z-buffer of the truth (motorcycle). `matched` is the part wrong among pixels that got a disparity, `all` counts
pixels without one as wrong. Times are processor time, the least of five. That of `bvm` is of
the whole command (reading, matching, writing, in new memory); OpenCV's of `compute` alone, in one process.
"""
import os
import pathlib
import resource
import subprocess
import sys
import tempfile
import time

import cv2
import numpy as np

DATA = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else os.environ.get("BP_DATA", "../shared/data")) / "stereo"
BVM = sys.argv[2] if len(sys.argv) > 2 else "target/release/bvm"
DISPARITIES, RUNS = 64, 5
MOTORCYCLE = dict(focal_px=994.978, cx_px=311.193, cy_px=254.877, baseline_m=0.193001, doffs_px=31.086)
# Cones has no published calibration: any will do, for disparities.
CONES = dict(focal_px=1000.0, cx_px=225.0, cy_px=187.0, baseline_m=0.16, doffs_px=0.0)


def seen_by_the_right_camera(truth):
    height, width = truth.shape
    rows, columns = np.nonzero(np.isfinite(truth) & (truth > 0))
    disparity = truth[rows, columns]
    place = np.round(columns - disparity).astype(int)
    inside = place >= 0
    rows, columns, place, disparity = rows[inside], columns[inside], place[inside], disparity[inside]
    nearest = np.full((height, width), -1.0)
    np.maximum.at(nearest, (rows, place), disparity)
    mask = np.zeros(truth.shape, bool)
    mask[rows, columns] = disparity >= nearest[rows, place] - 1
    return mask


def pairs():
    folder = DATA / "middlebury2014_motorcycle"
    archive = np.load(folder / "motorcycle_disp.npz")
    truth = archive[archive.files[0]].astype(float)
    files = folder / "motorcycle_left.png", folder / "motorcycle_right.png"
    yield "motorcycle", files, MOTORCYCLE, truth, seen_by_the_right_camera(truth)
    folder = DATA / "middlebury2003_cones"
    truth = cv2.imread(str(folder / "disp2.pgm"), 0) / 4.0
    mask = (cv2.imread(str(folder / "cones_mask_2bt.png"), 0) > 128) & (truth > 0)
    yield "cones", (folder / "im2.ppm", folder / "im6.ppm"), CONES, truth, mask


def read_pfm(path):
    with open(path, "rb") as file:
        assert file.readline() == b"Pf\n"
        width, height = map(int, file.readline().split())
        assert float(file.readline()) < 0
        return np.frombuffer(file.read(), "<f4").reshape(height, width)[::-1]


def ours(files, calibration, matcher):
    with tempfile.TemporaryDirectory() as folder:
        rig, disparity, confidence = (pathlib.Path(folder) / name for name in ("c.toml", "d.pfm", "c.pfm"))
        keys = {**calibration, "max_disparity_px": DISPARITIES}
        rig.write_text("".join(f"{key} = {value}\n" for key, value in keys.items()))
        command = [BVM, "look", "--left", files[0], "--right", files[1], "--calibration", rig, "--matcher", matcher]
        command += ["--disparity", disparity, "--confidence", confidence]
        environment = {**os.environ, "RAYON_NUM_THREADS": "1"}
        told = [run(command, environment) for _ in range(RUNS)]
        return read_pfm(disparity), read_pfm(confidence), min(told)


def run(command, environment):
    """Processor time of the whole command in ms: reading, matching and writing, in a process that has just begun."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run(command, env=environment, check=True, stdout=subprocess.DEVNULL)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return 1e3 * (after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime)


def peer(algorithm, left, right):
    times = []
    for _ in range(RUNS):
        start = time.process_time()
        disparity = algorithm.compute(left, right)
        times.append(1e3 * (time.process_time() - start))
    disparity = disparity / 16.0
    return np.where(disparity >= 0, disparity, np.inf), min(times)


def sgbm(mode, uniqueness=10):
    return cv2.StereoSGBM.create(
        0, DISPARITIES, 3, P1=8 * 9, P2=32 * 9, disp12MaxDiff=1, uniquenessRatio=uniqueness,
        speckleWindowSize=100, speckleRange=2, mode=mode,
    )


def told(name, disparity, truth, mask, milliseconds):
    claimed = mask & np.isfinite(disparity)
    error = np.abs(np.where(claimed, disparity, 0) - np.where(claimed, truth, 0))
    count, matched = mask.sum(), claimed.sum()
    figures = []
    for most in (1, 2):
        wrong = (error[claimed] > most).sum()
        figures += [100 * wrong / matched, 100 * (wrong + count - matched) / count]
    print("%-22s %6.1f %% %8.2f %8.2f %8.2f %8.2f %8.1f" % (
        name, 100 * matched / count, figures[0], figures[2], figures[1], figures[3], milliseconds))


def main():
    cv2.setNumThreads(1)
    for name, files, calibration, truth, mask in pairs():
        left, right = (cv2.imread(str(file), 0) for file in files)
        print("%-22s %8s %8s %8s %8s %8s %8s" % (
            name, "density", "bad>1", "bad>2", "all>1", "all>2", "ms"))
        for matcher in ("scanline", "coherence"):
            disparity, confidence, milliseconds = ours(files, calibration, matcher)
            told("bvm " + matcher, disparity, truth, mask, milliseconds)
            if matcher == "scanline":
                claimed = mask & np.isfinite(disparity)
                surest = np.argsort(-confidence[claimed], kind="stable")
                wrong = (np.abs(disparity - np.where(claimed, truth, 0))[claimed] > 2)[surest]
        told("StereoBM 15", *peer_figures(cv2.StereoBM.create(DISPARITIES, 15), left, right, truth, mask))
        for label, mode in (("SGBM 5 paths", 0), ("SGBM HH", 1), ("SGBM 3WAY", 2)):
            told(label, *peer_figures(sgbm(mode), left, right, truth, mask))
        print("  sparsification, bad>2 at one density: SGBM 3WAY by its uniqueness margin, bvm scanline by confidence")
        for uniqueness in (0, 10, 20, 30, 40, 60, 80):
            disparity, _ = peer(sgbm(2, uniqueness), left, right)
            claimed = mask & np.isfinite(disparity)
            error = np.abs(np.where(claimed, disparity, 0) - np.where(claimed, truth, 0))[claimed]
            kept = claimed.sum()
            here = 100 * wrong[:kept].mean() if kept <= len(wrong) else float("nan")
            print("  %6.1f %%  %6.2f  %6.2f" % (100 * kept / mask.sum(), 100 * (error > 2).mean(), here))
        print()


def peer_figures(algorithm, left, right, truth, mask):
    disparity, milliseconds = peer(algorithm, left, right)
    return disparity, truth, mask, milliseconds


if __name__ == "__main__":
    main()
