// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "compare/store/store.hpp"

namespace drape::compare {

/// Counts and findings of a verification.
struct Verification {
  std::vector<std::string> findings;  ///< empty if everything is as written
  std::int64_t manifests = 0;
  std::string last_manifest;  ///< SHA-256 of the last manifest
  long long rows = 0;         ///< number of listed keys and blobs hashed
  int comparisons = 0;        ///< number recomputed from their sheets, bit for bit
};

/// Compares the schema with this program's, every manifest, row and blob with its hash, the file
/// with the size stated in its last manifest, and every number with its recomputation from the
/// blobs; a number whose sheets are not in the store is a finding. Without `recompute` the numbers
/// are not checked. Files outside of the store are not read.
[[nodiscard]] Verification verify_store(const std::filesystem::path& store, bool recompute = true);

/// Findings about manifests, rows and blobs only.
[[nodiscard]] std::vector<std::string> altered_rows(const StoreReader& reader);

/// Signs the last manifest of the store with an Ed25519 private key (PEM) into `<store>.sig`.
/// Anyone who can write the file can alter rows and recompute every hash; only a signature reveals
/// that, to holders of the public key. Throws Error(bad_input) if the store is not as written or
/// the key is invalid.
void sign_store(const std::filesystem::path& store, const std::filesystem::path& private_key);

/// File of the signature.
[[nodiscard]] std::filesystem::path signature_path(const std::filesystem::path& store);

/// True if this manifest was signed with the private key that belongs to this public key (PEM).
/// Throws Error(bad_input) if there is no signature or the key is invalid.
[[nodiscard]] bool is_signed(const std::filesystem::path& store, const std::string& manifest_sha256,
                             const std::filesystem::path& public_key);

}  // namespace drape::compare
