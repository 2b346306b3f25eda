#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""crate.py FOLDER: what RO-Crate 1.3 and Process Run Crate 0.6 require of its metadata, and that the
headline number can be followed to photographs and curves. The graph is read after JSON-LD expansion
by pyld, a reader that knows neither drapebench nor RO-Crate; the context is the few terms used here,
with the meaning that the RO-Crate context gives them."""
import hashlib
import json
import pathlib
import re
import sys
import urllib.parse

import pyld

SCHEMA = "http://schema.org/"
TERMS = {
    "File": SCHEMA + "MediaObject",
    "conformsTo": "http://purl.org/dc/terms/conformsTo",
    "Profile": "http://www.w3.org/ns/dx/prof/Profile",
    **{
        term: SCHEMA + term
        for term in """CreativeWork Dataset SoftwareApplication CreateAction PropertyValue Person
        Organization about name description datePublished license author variableMeasured hasPart
        mentions version affiliation encodingFormat contentSize sha256 url identifier
        startTime endTime instrument object result agent value unitCode unitText""".split()
    },
}


def expect(condition, what):
    if not condition:
        sys.exit("crate: " + what)


def main():
    folder = pathlib.Path(sys.argv[1])
    document = json.loads((folder / "ro-crate-metadata.json").read_text(encoding="utf-8"))
    expect(document["@context"] == "https://w3id.org/ro/crate/1.3/context", "the context")
    keys = {key for entity in document["@graph"] for key in entity}
    expect(keys <= set(TERMS) | {"@id", "@type"}, f"terms not known: {keys - set(TERMS)}")
    document["@context"] = TERMS
    expanded = pyld.jsonld.expand(document, {"base": "crate://here/"})
    by_id = {entity["@id"]: entity for entity in expanded}
    expect(len(by_id) == len(document["@graph"]), "an entity is there twice or was lost")

    def values(entity, term):
        return [v.get("@value", v.get("@id")) for v in entity.get(TERMS[term], [])]

    def of_type(term):
        return [e for e in expanded if TERMS[term] in e["@type"]]

    # The descriptor, and the root with all required properties.
    descriptor = by_id["crate://here/ro-crate-metadata.json"]
    expect(values(descriptor, "conformsTo") == ["https://w3id.org/ro/crate/1.3"], "the version")
    root = by_id[values(descriptor, "about")[0]]
    for term in ("name", "description", "datePublished", "license", "author"):
        expect(values(root, term), f"the root has no {term}")
    expect(re.fullmatch(r"\d{4}-\d{2}-\d{2}(T[\d:]+Z)?", values(root, "datePublished")[0]), "date")
    profile = "https://w3id.org/ro/wfrun/process/0.6"
    expect(profile in values(root, "conformsTo"), "the profile")
    expect(TERMS["Profile"] in by_id[profile]["@type"], "the profile is no Profile")
    # Every reference is to a described entity.
    for entity in expanded:
        for term, items in entity.items():
            if not term.startswith("@"):
                for item in items:
                    if "@id" in item and item["@id"] not in (
                        "https://w3id.org/ro/crate/1.3",
                    ):
                        expect(item["@id"] in by_id, f"{item['@id']} is not described")
    # Every listed file exists with its bytes and is part of the root; no other file exists.
    files = of_type("File")
    for entity in files:
        path = folder / urllib.parse.unquote(entity["@id"].removeprefix("crate://here/"))
        sha256 = hashlib.sha256(path.read_bytes()).hexdigest()
        expect(values(entity, "sha256") == [sha256], f"bytes of {path}")
        expect(values(entity, "contentSize") == [str(path.stat().st_size)], f"size of {path}")
        expect(entity["@id"] in values(root, "hasPart"), f"{path} is no part")
        expect(values(entity, "description"), f"{path} is not described")
    on_disk = sum(p.is_file() for p in folder.rglob("*")) - 1
    expect(on_disk == len(files), f"{on_disk} files, {len(files)} entities")
    # Every run of a program names its program and is mentioned.
    actions = of_type("CreateAction")
    made_by = {}
    for action in actions:
        tool = by_id[values(action, "instrument")[0]]
        expect(TERMS["SoftwareApplication"] in tool["@type"], "the instrument is no software")
        for term in ("name", "url", "version"):
            expect(values(tool, term), f"software without {term}")
        expect(action["@id"] in values(root, "mentions"), "an action is not mentioned")
        for result in values(action, "result"):
            made_by.setdefault(result, []).append(action)
    # The chain from the headline leads to files that no program here made.
    headline = [e for e in of_type("PropertyValue") if "mean-distance" in e["@id"]]
    expect(len(headline) == 1, "no headline")
    expect(values(headline[0], "unitCode") == ["mm"], "no unit")
    expect(0 < float(values(headline[0], "value")[0]) < 100, "no distance")
    reached, waiting = set(), [headline[0]["@id"]]
    while waiting:
        here = waiting.pop()
        if here in reached:
            continue
        reached.add(here)
        for action in made_by.get(here, []):
            waiting += values(action, "object")
    photographs = {name for name in reached if name.endswith(".png")}
    curves = {name for name in reached if "/fabrics/" in name and name.endswith(".csv")}
    programs = {
        values(by_id[values(a, "instrument")[0]], "name")[0]
        for name in reached
        for a in made_by.get(name, [])
    }
    expect(len(photographs) >= 3 and curves, f"{len(photographs)} photographs, {len(curves)} curves")
    needed = {"drape-detect", "drape-calib", "drape-triangulate", "drape-simulate"}
    expect(needed <= programs, f"programs on the path: {programs}")
    print(
        f"{len(files)} files, {len(actions)} runs of {len(of_type('SoftwareApplication'))} programs; "
        f"the headline rests on {len(photographs)} photographs and {len(curves)} curves"
    )


main()
