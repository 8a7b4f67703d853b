"""Azimuth and front-back errors of `bvm listen` on measured heads.

In: the command, a SOFA file to calibrate with, one to render with (the same, or another head), dry sounds. Out: for each
kind of sound and ratio of signal to noise the root mean square error of azimuth in the front half of the horizontal plane,
the share of cases whose truth is within 10 degrees of a box of the 90 % region, and with `--sphere` the front-back errors
and the mean great-circle error over all directions. Needs only the standard library:

    python3 bvm/benches/hearing_kemar.py target/release/bvm KEMAR.sofa KEMAR.sofa speech1.wav speech2.wav [--mirror] [--sphere]
"""

import json, math, random, struct, subprocess, sys, tempfile, wave
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

flags = [word for word in sys.argv[1:] if word.startswith("--")]
bvm, calibrate_with, render_with, *sounds = [word for word in sys.argv[1:] if not word.startswith("--")]
folder = Path(tempfile.mkdtemp())


def run(*arguments):
    done = subprocess.run([bvm, *map(str, arguments)], capture_output=True, text=True)
    if done.returncode:
        sys.exit(f"{arguments}: {done.stderr}")
    return done.stdout


def second_of(path):
    """One second of speech, from 0.8 s on."""
    with wave.open(path) as sound:
        rate = sound.getframerate()
        sound.setpos(int(0.8 * rate))
        frames = sound.readframes(rate)
    out = folder / ("dry_" + Path(path).name)
    with wave.open(str(out), "w") as sound:
        sound.setnchannels(1), sound.setsampwidth(2), sound.setframerate(rate)
        sound.writeframes(frames)
    return out


def noise():
    out, numbers = folder / "dry_noise.wav", random.Random(1)
    with wave.open(str(out), "w") as sound:
        sound.setnchannels(1), sound.setsampwidth(2), sound.setframerate(44100)
        sound.writeframes(b"".join(struct.pack("<h", int(3000 * numbers.gauss(0, 1))) for _ in range(44100)))
    return out


run("calibrate", "audition", "--hrir", calibrate_with, "--out", folder / "listen.json")
mirror = ["--mirror"] if "--mirror" in flags else []
run("calibrate", "audition", "--hrir", render_with, "--out", folder / "render.json", *mirror)
rendered = json.loads((folder / "render.json").read_text())
places = [(one["azimuth_deg"], one["elevation_deg"]) for one in rendered["directions"]]
whole = "--sphere" in flags
if whole:
    places = places[::7]
else:
    places = [(az, el) for az, el in places if el == 0 and abs(az) <= 90]
kinds = {"speech": [second_of(path) for path in sounds], "noise": [noise()]}


def unit(azimuth, elevation):
    az, el = math.radians(azimuth), math.radians(elevation)
    return (math.cos(el) * math.cos(az), math.cos(el) * math.sin(az), math.sin(el))


def case(job):
    number, dry, snr, azimuth, elevation = job
    wav = folder / f"{number}.wav"
    run("synth", "--calibration", folder / "render.json", "--source", dry, "--azimuth", azimuth, "--elevation", elevation,
        "--snr", snr, "--seed", number, "--out", wav)
    look = json.loads(run("listen", "--wav", wav, "--calibration", folder / "listen.json", "--json",
                          "--directions", "all" if whole else "frontal").splitlines()[0])
    wav.unlink()
    if not look["sources"]:  # not heard: counts as straight ahead
        look["sources"] = [dict(azimuth_deg=0, elevation_deg=0, region90=[])]
    first = look["sources"][0]
    truth, found = unit(azimuth, elevation), unit(first["azimuth_deg"], first["elevation_deg"])
    within = lambda value, edges: any(edges[0] <= value + turn <= edges[1] for turn in (-360, 0, 360))
    covered = any(within(azimuth, box["azimuth_deg"]) and within(elevation, box["elevation_deg"]) for box in first["region90"])
    dot = max(-1, min(1, sum(a * b for a, b in zip(truth, found))))
    sided = abs(truth[0]) > 0.26
    return (first["azimuth_deg"] - azimuth, covered or look["flat"], math.degrees(math.acos(dot)), sided,
            sided and truth[0] * found[0] < 0)


for kind, dries in kinds.items():
    for snr in (20, 10, 0):
        jobs = [(n, dry, snr, *place) for n, (dry, place) in enumerate((d, p) for d in dries for p in places)]
        with ThreadPoolExecutor(2) as pool:
            results = list(pool.map(case, jobs))
        count = len(results)
        rms = math.sqrt(sum(error * error for error, *_ in results) / count)
        line = f"{kind:7} {snr:3} dB  n {count:4}  90 % region holds {100 * sum(r[1] for r in results) / count:5.1f} %"
        if whole:
            sides = max(1, sum(r[3] for r in results))
            line += f"  great circle {sum(r[2] for r in results) / count:5.1f}°  front-back {100 * sum(r[4] for r in results) / sides:5.1f} %"
        else:
            line += f"  azimuth RMS {rms:5.2f}°"
        print(line, flush=True)
