// SPDX-License-Identifier: Apache-2.0
// crate.js FOLDER: checks the crate with the independent validator of ro-crate-js; NODE_PATH names
// the node_modules that contain it.
const fs = require("fs");
const path = require("path");
const { ROCrate, validate } = require("ro-crate");

async function main() {
  const folder = process.argv[2];
  const json = JSON.parse(fs.readFileSync(path.join(folder, "ro-crate-metadata.json"), "utf8"));
  // Its own copy of the context is of RO-Crate 1.2, which has every term in use; 1.3's is on the network.
  json["@context"] = "https://w3id.org/ro/crate/1.2/context";
  const files = {};
  for (const name of fs.readdirSync(folder, { recursive: true })) {
    const isDir = fs.statSync(path.join(folder, name)).isDirectory();
    if (!isDir) files[encodeURI(name)] = { exists: true, inCrate: false, isDir };
  }
  const results = await validate(new ROCrate(json, { array: true, link: true }), files);
  const wrong = results.filter((r) => r.status === "error");
  const warned = results.filter((r) => r.status === "warning" && r.entity !== "ro-crate-metadata.json");
  for (const r of [...wrong, ...warned]) console.log(`${r.status}: ${r.message} ${r.entity || ""}`);
  const passed = results.filter((r) => r.status === "success").length;

  console.log(`validator: ${passed} checks passed, ${wrong.length} errors, ${warned.length} warnings, ` +
    `${Object.keys(files).length} files looked up`);
  // Without a network the context cannot be fetched, which gives one warning of two sentences.
  const others = warned.filter((r) => !["contextUrlNotFound", "hasContext"].includes(r.id));
  if (passed < 8 || wrong.length || others.length) process.exit(1);
}

main().catch((error) => {
  console.error(error);
  process.exit(1);
});
