#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""validate.py SCHEMAS FOLDER...: every JSON file below the folders against the JSON Schema that its
key `schema` names, by python3-jsonschema, which knows nothing of drapebench. Exit code 1: a file
does not fit, or has no schema. Prints how many files of each kind were read."""
import collections
import json
import pathlib
import sys

import jsonschema


def read(file):
    with open(file, encoding="utf-8") as stream:
        return json.load(stream)


def main():
    schemas = {}
    for file in sorted(pathlib.Path(sys.argv[1]).glob("*.schema.json")):
        schema = read(file)
        jsonschema.Draft202012Validator.check_schema(schema)
        for name in schema["properties"]["schema"].get("enum", [schema["title"]]):
            schemas[name] = jsonschema.Draft202012Validator(schema)
    seen, wrong = collections.Counter(), 0
    files = [f for folder in sys.argv[2:] for f in sorted(pathlib.Path(folder).rglob("*.json"))]
    for file in files:
        document = read(file)
        if "schema" not in document:
            if file.name != "ro-crate-metadata.json":
                print(f"{file}: no key `schema`")
                wrong += 1
            continue
        kind = document["schema"]
        seen[kind] += 1
        if kind not in schemas:
            print(f"{file}: no schema for {kind}")
            wrong += 1
            continue
        for error in schemas[kind].iter_errors(document):
            print(f"{file}: /{'/'.join(map(str, error.absolute_path))}: {error.message[:200]}")
            wrong += 1
            break
    for kind in sorted({s.schema["title"] for s in schemas.values()}):
        print(f"{seen[kind]:6} {kind}")
    return 1 if wrong or not files else 0


sys.exit(main())
