// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "compare/store/store.hpp"

namespace drape::compare {

/// Counts and findings of a check.
struct Verification {
  std::vector<std::string> findings;  ///< empty: all is as it was written
  std::int64_t manifests = 0;
  std::string last_manifest;  ///< its SHA-256
  long long rows = 0;         ///< hashes of listed rows and blobs
  int comparisons = 0;        ///< computed again from their sheets, bit for bit
};

/// Compares the schema with this program's, every manifest, row and blob with its hash, the file
/// with the size that its last manifest says, and every number with what comes out of the blobs;
/// one whose sheets the store lacks is a finding. With `recompute` off the last is left out. Files
/// outside of the store are not read.
[[nodiscard]] Verification verify_store(const std::filesystem::path& store, bool recompute = true);

/// Findings about manifests, rows and blobs alone.
[[nodiscard]] std::vector<std::string> altered_rows(const StoreReader& reader);

/// Signs the last manifest of the store with an Ed25519 private key (PEM) into `<store>.sig`. Who
/// writes the file can alter rows and compute every hash again; only a signature shows that, to
/// those who have the public key. Throws Error(bad_input) when the store is not as it was written
/// or the key is none.
void sign_store(const std::filesystem::path& store, const std::filesystem::path& private_key);

/// File of the signature.
[[nodiscard]] std::filesystem::path signature_path(const std::filesystem::path& store);

/// True when this manifest is what was signed with the private key of this public key (PEM). Throws
/// Error(bad_input) when there is no signature or the key is none.
[[nodiscard]] bool is_signed(const std::filesystem::path& store, const std::string& manifest_sha256,
                             const std::filesystem::path& public_key);

}  // namespace drape::compare
