#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""history.py BIN STORE RUNS WORK: CPU time of questions to a long history.

Copies the last run of STORE until WORK/history.sqlite has RUNS of them, each with its own sheets, simulations and
comparisons under new keys (no marks: nothing here asks for them), with dates days apart and every fourth run with
another friction, and lists all in one more manifest, hashed here as compare/README.md says. Prints how many rows each table has, and of each question the best CPU time of
seven (user and system, program start and output included)."""
import hashlib
import pathlib
import re
import resource
import sqlite3
import struct
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


NUMBERS = {"run": "(SELECT sha256 FROM run WHERE number = t.run)",
           "comparison_id": "(SELECT sha256 FROM comparison WHERE id = t.comparison_id)"}
OWN = {"run": "number", "comparison": "id"}


def packed(value):
    if value is None:
        return b"n"
    if isinstance(value, int):
        return b"i" + struct.pack("<q", value)
    if isinstance(value, float):
        return b"r" + struct.pack("<d", value)
    text = value.encode()
    return b"t" + str(len(text)).encode() + b":" + text


def list_rows(db, tables):
    """Lists all rows of these tables that no manifest lists, in one more."""
    lines, (last,) = [], db.execute("SELECT max(sequence) FROM listed").fetchone()
    for table in tables:
        (sql,) = db.execute("SELECT sql FROM sqlite_master WHERE name = ?", (table,)).fetchone()
        later = set(re.findall(r'"?(\w+)"? (?:TEXT|INTEGER|REAL)\b.*--.*since \d+:', sql))
        names = [row[1] for row in db.execute(f"PRAGMA table_info({table})") if row[1] != OWN.get(table)]
        primary = [row[1] for row in sorted(db.execute(f"PRAGMA table_info({table})"), key=lambda r: r[5]) if row[5]]
        key = "sha256" if table in OWN else "run" if "run" in primary else primary[0]
        sql_of = {name: NUMBERS.get(name, f't."{name}"') for name in names}
        order = ", ".join([sql_of[key]] + [sql_of[p] for p in primary if p != key and p in sql_of])
        number = f"t.{OWN[table]}" if table in OWN else "NULL"
        groups = {}
        for row in db.execute(f"SELECT {sql_of[key]}, {number}, {', '.join(sql_of[n] for n in names)} FROM {table} AS t "
                              f"ORDER BY {order}"):
            content = groups.setdefault((row[0], row[1]), [f"drapebench/rows/1\n{table}\n".encode()])
            content.append(b"\n" + b"".join(packed(v) for n, v in zip(names, row[2:]) if n not in later or v is not None))
        known = {k for (k,) in db.execute("SELECT key FROM listed WHERE kind = ?", (table,))}
        for (key, number), content in groups.items():
            if key in known:
                continue
            last += 1
            sha256 = hashlib.sha256(b"".join(content)).hexdigest()
            db.execute("INSERT INTO listed VALUES (?, ?, ?, ?, ?)", (last, table, key, number, sha256))
            lines.append(f"{last} {table} {'' if number is None else number} {sha256} {len(key)} {key}\n")
    db.commit()
    db.execute("VACUUM")
    before, previous = db.execute("SELECT number, sha256 FROM manifest ORDER BY number DESC").fetchone()
    size = [db.execute(f"PRAGMA {what}").fetchone()[0] for what in ("page_count", "page_size")]
    text = f"drapebench/manifest/1\n{before + 1}\n{previous}\n{size[0] * size[1]}\n" + "".join(lines)
    db.execute("INSERT INTO manifest VALUES (?, ?, ?, ?, ?)",
               (before + 1, previous, last, size[0] * size[1], hashlib.sha256(text.encode()).hexdigest()))
    db.commit()


def lengthen(file, runs):
    db = sqlite3.connect(file)
    triggers = db.execute("SELECT name, sql FROM sqlite_master WHERE type = 'trigger'").fetchall()
    for name, _ in triggers:
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
    for _, sql in triggers:
        db.execute(sql)
    list_rows(db, ("sheet", "simulation", "comparison", "run", "run_drape", "run_comparison", "run_value", "run_match",
                   "match_basis"))
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
