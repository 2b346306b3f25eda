#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""A triangulation stage of another lab: plain linear triangulation, written from CONVENTIONS.md alone.

Takes the place of drape-triangulate in a test. Knows the formats detections/1, calibration/1, sheet/1 and run/1, and none of
drapebench's code. The covariance is that of the pixels alone; no correction for the shape of a dot.
"""
import datetime
import hashlib
import json
import pathlib
import sys

MIN_VIEWS = 2


def sha256(path):
    return hashlib.sha256(pathlib.Path(path).read_bytes()).hexdigest()


def now():
    return datetime.datetime.now(datetime.timezone.utc).strftime("%Y-%m-%dT%H:%M:%SZ")


def undistorted(lens, px):
    """Normalised image coordinates of a pixel; Brown's model inverted by fixed-point iteration."""
    x0, y0 = (px[0] - lens["cx_px"]) / lens["fx_px"], (px[1] - lens["cy_px"]) / lens["fy_px"]
    x, y = x0, y0
    for _ in range(50):
        r2 = x * x + y * y
        radial = 1 + r2 * (lens["k1"] + r2 * (lens["k2"] + r2 * lens["k3"]))
        dx = 2 * lens["p1"] * x * y + lens["p2"] * (r2 + 2 * x * x)
        dy = lens["p1"] * (r2 + 2 * y * y) + 2 * lens["p2"] * x * y
        x, y = (x0 - dx) / radial, (y0 - dy) / radial
    return x, y


def solve3(a, b):
    """Solution of a 3x3 system and the inverse of its matrix, by cofactors."""
    inverse = [[0.0] * 3 for _ in range(3)]
    for i in range(3):
        for j in range(3):
            r, s = [k for k in range(3) if k != j], [k for k in range(3) if k != i]
            minor = a[r[0]][s[0]] * a[r[1]][s[1]] - a[r[0]][s[1]] * a[r[1]][s[0]]
            inverse[i][j] = (-1) ** (i + j) * minor
    determinant = sum(a[0][k] * inverse[k][0] for k in range(3))
    inverse = [[v / determinant for v in row] for row in inverse]
    return [sum(inverse[i][k] * b[k] for k in range(3)) for i in range(3)], inverse


def triangulated(views):
    """Point in mm, covariance in mm^2 and RMS in px; two passes, the second weighted by depth."""
    point = None
    for _ in range(3):
        a, b = [[0.0] * 3 for _ in range(3)], [0.0] * 3
        for camera, detection in views:
            rotation, t = camera["cam_from_world"]["rotation"], camera["cam_from_world"]["translation_mm"]
            x, y = undistorted(camera["lens"], detection["px"])
            depth = 1000.0 if point is None else sum(rotation[2][k] * point[k] for k in range(3)) + t[2]
            for axis, at, f in ((0, x, "fx_px"), (1, y, "fy_px")):
                sigma = detection["cov_px2"][axis][axis] ** 0.5
                weight = camera["lens"][f] / (depth * sigma)
                row = [weight * (rotation[axis][k] - at * rotation[2][k]) for k in range(3)]
                right = weight * (at * t[2] - t[axis])
                for i in range(3):
                    b[i] += row[i] * right
                    for j in range(3):
                        a[i][j] += row[i] * row[j]
        point, covariance = solve3(a, b)
    squares = 0.0
    for camera, detection in views:
        rotation, t = camera["cam_from_world"]["rotation"], camera["cam_from_world"]["translation_mm"]
        seen = [sum(rotation[i][k] * point[k] for k in range(3)) + t[i] for i in range(3)]
        x, y = undistorted(camera["lens"], detection["px"])
        squares += ((seen[0] / seen[2] - x) * camera["lens"]["fx_px"]) ** 2
        squares += ((seen[1] / seen[2] - y) * camera["lens"]["fy_px"]) ** 2
    return point, covariance, (squares / (2 * len(views))) ** 0.5


def main(words):
    started = now()
    detections_file, options = words[0], dict(zip(words[1::2], words[2::2]))
    detections = json.loads(pathlib.Path(detections_file).read_text())
    calibration = json.loads(pathlib.Path(options["--calibration"]).read_text())
    cameras = {camera["name"]: camera for camera in calibration["cameras"]}
    frames = [f for f in detections["frames"] if f["set"] == options["--set"]]
    views = {}
    for frame in frames:
        for detection in frame["detections"]:
            mark = (detection["row"], detection["col"])
            views.setdefault(mark, []).append((cameras[frame["camera"]], detection))
    lattice = detections["lattice"]
    marks, gaps = [], []
    for row in range(lattice["rows"]):
        for col in range(lattice["cols"]):
            seen = views.get((row, col), [])
            if len(seen) < MIN_VIEWS:
                gaps.append({"row": row, "col": col, "reason": f"seen by {len(seen)} cameras"})
                continue
            point, covariance, rms = triangulated(seen)
            material = [lattice["margin_mm"][0] + row * lattice["pitch_mm"],
                        lattice["margin_mm"][1] + col * lattice["pitch_mm"]]
            marks.append({"row": row, "col": col, "material_mm": material, "xyz_mm": point,
                          "cov_mm2": covariance, "views": len(seen), "reprojection_px": rms})
    sheet = {"schema": "drapebench/sheet/1", "kind": "measured", "rows": lattice["rows"],
             "cols": lattice["cols"], "patch_mm": lattice["patch_mm"],
             "source": {"rig": detections["rig"], "set": options["--set"],
                        "cameras": [f["camera"] for f in frames],
                        "calibration_sha256": sha256(options["--calibration"]),
                        "detections_sha256": sha256(detections_file)},
             "marks": marks, "gaps": gaps}
    ply = pathlib.Path(options["--out"])
    # Seven digits, no faces, single-precision columns, other order, as another program might write.
    lines = ["ply", "format ascii 1.0", f"element vertex {len(marks)}", "property int col",
             "property int row", "property float x", "property float y", "property float z", "end_header"]
    for mark in reversed(marks):
        x, y, z = mark["xyz_mm"]
        lines.append(f"{mark['col']} {mark['row']} {x:.4f} {y:.4f} {z:.4f}")
    ply.write_text("\n".join(lines) + "\n")
    ply.with_suffix(".json").write_text(json.dumps(sheet))
    verdict = f"{len(marks)} of {len(marks) + len(gaps)} marks measured"
    outputs = [ply, ply.with_suffix(".json")]
    record = {"schema": "drapebench/run/1", "program": "drape-triangulate", "version": "another lab's 1.0",
              "program_sha256": sha256(__file__), "arguments": words, "options": {"set": options["--set"]},
              "inputs": [{"file": str(pathlib.Path(f).resolve()), "sha256": sha256(f)}
                         for f in (detections_file, options["--calibration"])],
              "outputs": [{"file": f.name, "sha256": sha256(f)} for f in outputs],
              "started_utc": started, "ended_utc": now(), "exit_code": 0}
    ply.with_suffix(".run.json").write_text(json.dumps(record))
    print(json.dumps({"verdict": "GO", "sentence": verdict, "numbers": {}, "rejected": [], "next_command": ""}))
    return 0


if __name__ == "__main__":
    sys.exit(main([word for word in sys.argv[1:] if word != "--json"]))
