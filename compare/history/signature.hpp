// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

namespace drape::compare {

/// Signs the seal of the store with an Ed25519 private key (PEM) into `<store>.seal.sig`, so that
/// whoever rewrites store, ledger and seal together is found by those who have the public key.
/// Throws Error(bad_input) when the store has no seal or the key is none.
void sign_seal(const std::filesystem::path& store, const std::filesystem::path& private_key);

/// True when the seal is what was signed with the private key of this public key (PEM). Throws
/// Error(bad_input) when there is no signature or the key is none.
[[nodiscard]] bool is_signed(const std::filesystem::path& store,
                             const std::filesystem::path& public_key);

}  // namespace drape::compare
