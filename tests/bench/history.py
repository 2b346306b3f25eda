#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""history.py BIN STORE RUNS WORK: CPU time of questions to a long history.

Copies the last run of STORE until WORK/history.sqlite has RUNS of them, each with its own sheets, simulations and
comparisons under new keys (no marks, no ledger: nothing here asks for them), with dates days apart and every
fourth run with another friction. Prints how many rows each table has, and of each question the best CPU time of
seven (user and system, program start and output included)."""
import hashlib
import pathlib
import resource
import sqlite3
import subprocess
import sys

KEYS = ("sha256", "measured_sha256", "simulated_sha256", "sheet_sha256", "headline_sha256", "pictures_sha256",
        "first_sha256", "second_sha256", "run_sha256", "match_sha256")


def copy(db, table, where, change):
    """Inserts the rows of `table` again as `change` makes them."""
    names = [row[1] for row in db.execute(f"PRAGMA table_info({table})")]
    rows = [dict(zip(names, row)) for row in db.execute(f"SELECT * FROM {table} WHERE {where}")]
    db.executemany(
        f"INSERT INTO {table} ({', '.join(names)}) VALUES ({', '.join('?' * len(names))})".replace('"', ""),
        [[change(dict(row))[name] for name in names] for row in rows])


def lengthen(file, runs):
    db = sqlite3.connect(file)
    for (name,) in db.execute("SELECT name FROM sqlite_master WHERE type = 'trigger'").fetchall():
        db.execute(f"DROP TRIGGER {name}")
    (last,) = db.execute("SELECT max(number) FROM run").fetchone()
    comparisons = f"id IN (SELECT comparison_id FROM run_comparison WHERE run = {last})"
    sheets = (f"SELECT measured_sha256 FROM comparison WHERE {comparisons} UNION "
              f"SELECT simulated_sha256 FROM comparison WHERE {comparisons}")
    (run_sha256,) = db.execute(f"SELECT sha256 FROM run WHERE number = {last}").fetchone()
    matches = f"SELECT sha256 FROM run_match WHERE run_sha256 = '{run_sha256}'"
    (span,) = db.execute("SELECT max(id) FROM comparison").fetchone()
    for number in range(1, runs):
        def change(row):
            for key in KEYS:
                if row.get(key):
                    row[key] = hashlib.sha256(f"{row[key]} {number}".encode()).hexdigest()
            if "number" in row:
                row["number"] += number
                row["date"] = f"{2000 + number // 360:04}-{number // 30 % 12 + 1:02}-{number % 30 + 1:02}T00:00:00Z"
            if "run" in row:
                row["run"] += number
            if "id" in row:
                row["id"] += number * span
            if "comparison_id" in row:
                row["comparison_id"] += number * span
            if row.get("key") == "friction" and number % 4 == 0:
                row["value"] = "0.25"
            return row

        for table, where in [("sheet", f"sha256 IN ({sheets})"), ("simulation", f"sheet_sha256 IN ({sheets})"),
                             ("comparison", comparisons), ("run", f"number = {last}"), ("run_drape", f"run = {last}"),
                             ("run_comparison", f"run = {last}"), ("run_value", f"run = {last}"),
                             ("run_match", f"run_sha256 = '{run_sha256}'"),
                             ("match_basis", f"match_sha256 IN ({matches})")]:
            copy(db, table, where, change)
    db.commit()
    db.execute("VACUUM")
    for table in ("run", "run_drape", "run_comparison", "run_value", "run_match", "match_basis", "comparison", "sheet"):
        print(f"{table}: {db.execute(f'SELECT count(*) FROM {table}').fetchone()[0]} rows")
    (calibration,) = db.execute(f"SELECT calibration_sha256 FROM run WHERE number = {last}").fetchone()
    (comparison,) = db.execute(f"SELECT sha256 FROM comparison WHERE {comparisons} LIMIT 1").fetchone()
    return last, calibration, comparison


def best_ms(command):
    times = []
    for _ in range(7):
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        done = subprocess.run(command, capture_output=True, text=True)
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        if done.returncode not in (0, 1):
            sys.exit(f"{command}: {done.stderr}")
        times.append(after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime)
    return 1000 * min(times), done.stdout.count("\n")


def main():
    bin_folder, store, runs, work = pathlib.Path(sys.argv[1]), sys.argv[2], int(sys.argv[3]), pathlib.Path(sys.argv[4])
    file = work / "history.sqlite"
    file.write_bytes(pathlib.Path(store).read_bytes())
    last, calibration, comparison = lengthen(file, runs)
    print(f"{file.stat().st_size / 1e6:.0f} MB")
    middle = last + runs // 2
    for words in ([["runs"], ["runs", "--since", "2001-03-01", "--until", "2001-03-31"], ["list", "--run", str(middle)],
                   ["list", "--scene", "A", "--grid", "21"],
                   ["list", "--scene", "A", "--grid", "21", "--since", "2001-03-01", "--until", "2001-03-31"],
                   ["diff", str(middle), str(middle + 1)], ["show", comparison[:16]],
                   ["trend", "--by", "friction"], ["trend", "--by", "fabric"],
                   ["sql", "SELECT scene, model, avg(mean_mm), count(*) FROM comparison JOIN simulation ON "
                    "sheet_sha256 = simulated_sha256 GROUP BY 1, 2"]]):
        ms, lines = best_ms([str(bin_folder / "drape-results"), *words, "--store", str(file)])
        print(f"{ms:7.1f} ms  {lines:6} lines  {' '.join(words)[:90]}")


main()
