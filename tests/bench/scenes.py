#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Draws realistic scenes and counts how many of their drapes are certified.

    scenes.py BIN COUNT [--spacings-mm 5,2.5] [--seed 1] [--jobs 2] [--out FOLDER] [--only 3,17]
              [--internal-friction]

Bodies: sphere, box, cylinder (standing or lying), closed triangle mesh of 500 to 5,000 facets, none
(two to four pins), and cloth that meets itself (a body much smaller than the cloth, pins near each
other). Fabrics by KES numbers over the range of woven apparel fabrics (Kawabata 1980); with
--internal-friction they have loops and up to three events of a history too. Ends with exit code 1
where fewer than 98 % are GO or one that passes through something is called at rest.
"""
import argparse, collections, concurrent.futures, json, math, pathlib, random, subprocess, sys, time

KINDS = ["sphere", "box", "cylinder", "pins", "mesh", "folded"]


def spread_of(r):
    return lambda low, high: math.exp(r.uniform(math.log(low), math.log(high)))


def loops_of(r):
    """What a fabric's tables get for its loops: of bending and of shear."""
    spread = spread_of(r)
    narrow = spread(0.3, 4)
    bending = f", hb2_gf_cm_per_cm = {spread(0.02, 0.25):.4f}, slip_curvature_per_cm = {spread(0.05, 0.3):.3f}"
    shear = (f", hg2_gf_per_cm = {narrow:.3f}, hg5_gf_per_cm = {narrow * spread(1, 3):.3f}"
             f", slip_angle_deg = {spread(0.2, 1):.3f}")
    return bending, shear


def history_of(r):
    along = lambda: r.choice(["warp", "weft"])
    events = [lambda: "flat", lambda: f"bent {r.uniform(-3, 3):.2f} per cm along {along()}",
              lambda: f"draped {r.randint(1, 3)} times"]
    history = [r.choice(events)() for _ in range(r.randint(0, 2))]
    if r.random() < 0.5:
        history.append(f"shaken {r.randint(1, 5)} times by {r.randint(5, 60)} %")
    return f"history = {json.dumps(history)}\n"


def fabric_text(r, name, loops=("", "")):
    spread = spread_of(r)
    b = spread(0.03, 0.25)
    weft = b * spread(0.5, 1.2)
    return f"""schema = "drapebench/fabric/1"
name = "{name}"
areal_density_g_per_m2 = {spread(80, 300):.1f}
stand_ins = ["all"]
[tensile]
warp_kes = {{ emt_percent = {spread(2, 8):.2f}, lt = {r.uniform(0.55, 0.85):.3f}, rt_percent = 60 }}
weft_kes = {{ emt_percent = {spread(3, 12):.2f}, lt = {r.uniform(0.55, 0.85):.3f}, rt_percent = 60 }}
[shear]
warp_kes = {{ g_gf_per_cm_deg = {(g := spread(0.3, 1.5)):.3f}{loops[1]} }}
weft_kes = {{ g_gf_per_cm_deg = {g:.3f}{loops[1]} }}
[bending]
warp_kes = {{ b_gf_cm2_per_cm = {b:.4f}{loops[0]} }}
weft_kes = {{ b_gf_cm2_per_cm = {weft:.4f}{loops[0]} }}
"""


def print_text(side):
    return f"""schema = "drapebench/print/1"
rows = 11
cols = 11
pitch_mm = {side / 10}
dot_diameter_mm = 4.0
patch_mm = [{side}, {side}]
margin_mm = [0.0, 0.0]
[tags]
family = "tag36h11"
edge_mm = 10.0
first_id = 0
cells = []
"""


def blob(r, facets, size):
    """A closed smooth body: an ellipsoid with bumps, as rings of quadrilaterals in two triangles."""
    rings = max(8, int(math.sqrt(facets / 4)))
    around = 2 * rings
    axes = [size * r.uniform(0.7, 1.3) / 2 for _ in range(3)]
    waves = [(r.randint(1, 3), r.randint(1, 4), r.uniform(0, 2 * math.pi), r.uniform(0.02, 0.08)) for _ in range(3)]

    def point(u, v):
        bump = 1 + sum(a * math.sin(k * u) ** 2 * math.cos(m * v + p) for k, m, p, a in waves)
        return (axes[0] * bump * math.sin(u) * math.cos(v), axes[1] * bump * math.sin(u) * math.sin(v),
                axes[2] * bump * math.cos(u))

    points = [point(0, 0)]
    for i in range(1, rings):
        points += [point(math.pi * i / rings, 2 * math.pi * j / around) for j in range(around)]
    points.append(point(math.pi, 0))
    at = lambda i, j: 1 + (i - 1) * around + j % around
    faces = []
    for j in range(around):
        faces.append((0, at(1, j), at(1, j + 1)))
        faces.append((len(points) - 1, at(rings - 1, j + 1), at(rings - 1, j)))
        for i in range(1, rings - 1):
            faces.append((at(i, j), at(i + 1, j), at(i + 1, j + 1)))
            faces.append((at(i, j), at(i + 1, j + 1), at(i, j + 1)))
    return points, faces, max(p[2] for p in points)


def draw(folder, seed, number, internal_friction):
    r = random.Random(f"{seed} {number}")
    past = random.Random(f"{seed} {number} past")
    kind = KINDS[number % len(KINDS)]
    folder.mkdir(parents=True, exist_ok=True)
    side = r.choice([150.0, 200.0, 220.0, 250.0, 300.0])
    (folder / "fabric.toml").write_text(
        fabric_text(r, "drawn", loops_of(past) if internal_friction else ("", "")))
    (folder / "print.toml").write_text(print_text(side))
    shift = [r.uniform(-0.1, 0.1) * side for _ in range(2)]
    yaw = r.uniform(0, 90)
    scene = f'schema = "drapebench/scene/1"\nname = "S{number}"\nfabric = "fabric.toml"\nprint = "print.toml"\n'
    friction = r.uniform(0.15, 0.6)
    body, pins, top = "", "", 0.0
    size = side * r.uniform(0.3, 0.65)
    place = "x_mm = 0\ny_mm = 0\nz_bottom_mm = 0\n"
    shape = kind
    if kind == "folded":
        size = side * r.uniform(0.12, 0.22)
        shape = r.choice(["sphere", "box", "cylinder", "pins"])
    if shape == "sphere":
        body, top = f'[[object]]\nkind = "sphere"\ndiameter_mm = {size:.3f}\n{place}', size
    elif shape == "box":
        top = size * r.uniform(0.6, 1.4)
        body = (f'[[object]]\nkind = "box"\nsize_mm = [{size:.3f}, {size * r.uniform(0.6, 1.4):.3f}, {top:.3f}]\n'
                f'edge_radius_mm = {r.uniform(0.5, 5):.3f}\nyaw_deg = {r.uniform(0, 90):.3f}\n{place}')
    elif shape == "cylinder":
        lying = r.random() < 0.4
        height = size * r.uniform(0.8, 2)
        top = size if lying else height
        axis = "[1, 0, 0]" if lying else "[0, 0, 1]"
        body = (f'[[object]]\nkind = "cylinder"\ndiameter_mm = {size:.3f}\nheight_mm = {height:.3f}\naxis = {axis}\n'
                f'edge_radius_mm = {r.uniform(1, 5):.3f}\n{place}')
    elif shape == "mesh":
        points, faces, top = blob(r, r.randint(500, 5000), size)
        (folder / "body.obj").write_text(
            "".join(f"v {x:.6f} {y:.6f} {z:.6f}\n" for x, y, z in points)
            + "".join(f"f {a + 1} {b + 1} {c + 1}\n" for a, b, c in faces))
        body = '[[object]]\nkind = "mesh"\nfile = "body.obj"\norigin_mm = [0, 0, 0]\n'
    else:
        # Pins on marks of the print, moved together by a fraction of the cloth between them.
        marks = r.sample([(0, 0), (0, 10), (10, 0), (10, 10), (0, 5), (5, 0), (5, 10), (10, 5)], r.randint(2, 4))
        near = r.uniform(0.3, 0.5) if kind == "folded" else r.uniform(0.75, 0.98)
        turn = math.radians(yaw)
        for row, col in marks:
            # Rows run along warp and columns along weft; in the start the axis of the rows is at yaw.
            x, y = (col - 5) * side / 10, (5 - row) * side / 10
            px, py = x * math.cos(turn) - y * math.sin(turn), x * math.sin(turn) + y * math.cos(turn)
            pins += f"[[pin]]\nrow = {row}\ncol = {col}\nat_mm = [{near * px:.4f}, {near * py:.4f}, 300.0]\n"
        top, shift = 297.0, [0.0, 0.0]
    start = f'[start]\nmode = "flat"\ncentre_mm = [{shift[0]:.3f}, {shift[1]:.3f}, {top + 3:.3f}]\nyaw_deg = {yaw:.3f}\n'
    start += history_of(past) if internal_friction else ""
    (folder / "scene.toml").write_text(
        f'{scene}table_z_mm = -400\nfriction = {friction:.3f}\nstand_ins = ["friction"]\n{start}{body}{pins}')
    return kind


def drape(task):
    args, number, spacing = task
    folder = args.out / f"{number:04d}"
    kind = draw(folder, args.seed, number, args.internal_friction)
    out = folder / f"{spacing}mm"
    began = time.monotonic()
    line = [args.bin / "drape-simulate", folder / "scene.toml", "--spacing-mm", spacing, "--segments", "5",
            "--threads", "1", "--quiet", "--json", "--out", out]
    line += ["--internal-friction"] if args.internal_friction else []
    done = subprocess.run(line, capture_output=True, text=True)
    lasted = time.monotonic() - began
    try:
        certificate = json.loads((out / "certificate.json").read_text())
        status = certificate.get("status", certificate.get("result", "?"))
    except OSError:
        certificate, status = {}, (done.stderr.strip().splitlines() or ["?"])[-1]
    return number, kind, spacing, done.returncode, status, lasted, done.stdout


def main():
    words = argparse.ArgumentParser()
    words.add_argument("bin", type=pathlib.Path)
    words.add_argument("count", type=int)
    words.add_argument("--spacings-mm", default="5,2.5")
    words.add_argument("--seed", type=int, default=1)
    words.add_argument("--jobs", type=int, default=2)
    words.add_argument("--internal-friction", action="store_true")
    words.add_argument("--only", default="")
    words.add_argument("--out", type=pathlib.Path, default=pathlib.Path("scenes"))
    args = words.parse_args()
    numbers = [int(n) for n in args.only.split(",")] if args.only else range(args.count)
    spacings = args.spacings_mm.split(",")
    tasks = [(args, n, s) for n in numbers for s in spacings]
    good, seen = collections.Counter(), collections.Counter()
    with concurrent.futures.ThreadPoolExecutor(args.jobs) as pool:
        for number, kind, spacing, code, status, lasted, said in pool.map(drape, tasks):
            seen[kind, spacing] += 1
            good[kind, spacing] += code == 0
            if code != 0:
                print(f"{number:4d} {kind:9s} {spacing} mm: {status} ({lasted:.1f} s)", flush=True)
    for spacing in spacings:
        row = [f"{k} {good[k, spacing]}/{seen[k, spacing]}" for k in KINDS]
        total = sum(good[k, spacing] for k in KINDS), sum(seen[k, spacing] for k in KINDS)
        print(f"{spacing} mm: {total[0]} of {total[1]} GO; " + ", ".join(row))
    share = sum(good.values()) / max(1, sum(seen.values()))
    return 0 if share >= 0.98 else 1


if __name__ == "__main__":
    sys.exit(main())
