// SPDX-License-Identifier: Apache-2.0
#include "compare/history/signature.hpp"

#include <openssl/evp.h>
#include <openssl/pem.h>

#include <memory>
#include <string>

#include "compare/history/seal.hpp"
#include "core/error.hpp"
#include "core/files/files.hpp"

namespace drape::compare {
namespace {

namespace fs = std::filesystem;
using Key = std::unique_ptr<EVP_PKEY, decltype(&EVP_PKEY_free)>;
using Context = std::unique_ptr<EVP_MD_CTX, decltype(&EVP_MD_CTX_free)>;

fs::path signature_path(const fs::path& store) {
  return seal_path(store).replace_extension(".sig");
}

enum class Half { secret, open };

/// Without a passphrase: a program cannot be asked for one.
Key read_key(const fs::path& file, Half half) {
  const std::string text = read_text(file);
  const std::unique_ptr<BIO, decltype(&BIO_free)> memory(
      BIO_new_mem_buf(text.data(), static_cast<int>(text.size())), &BIO_free);
  char none[] = "";
  Key key(half == Half::secret ? PEM_read_bio_PrivateKey(memory.get(), nullptr, nullptr, none)
                               : PEM_read_bio_PUBKEY(memory.get(), nullptr, nullptr, none),
          &EVP_PKEY_free);
  if (key && EVP_PKEY_get_base_id(key.get()) == EVP_PKEY_ED25519) return key;
  throw bad_input(
      half == Half::secret ? "this is no Ed25519 private key without passphrase"
                           : "this is no Ed25519 public key",
      {.file = file.string()},
      half == Half::secret
          ? "make one: openssl genpkey -algorithm ed25519 -out key.pem"
          : "make it from the private one: openssl pkey -in key.pem -pubout -out pub.pem");
}

std::string seal_text(const fs::path& store) {
  static_cast<void>(read_seal(store));  // says what is wrong with it
  return read_text(seal_path(store));
}

const unsigned char* bytes_of(const std::string& text) {
  return reinterpret_cast<const unsigned char*>(text.data());
}

}  // namespace

void sign_seal(const fs::path& store, const fs::path& private_key) {
  const Key key = read_key(private_key, Half::secret);
  const std::string text = seal_text(store);
  const Context context(EVP_MD_CTX_new(), &EVP_MD_CTX_free);
  std::string signature(64, '\0');  // RFC 8032
  std::size_t size = signature.size();
  if (EVP_DigestSignInit(context.get(), nullptr, nullptr, nullptr, key.get()) != 1 ||
      EVP_DigestSign(context.get(), reinterpret_cast<unsigned char*>(signature.data()), &size,
                     bytes_of(text), text.size()) != 1)
    throw internal_error("the seal cannot be signed");
  write_durable(signature_path(store), signature);
}

bool is_signed(const fs::path& store, const fs::path& public_key) {
  const Key key = read_key(public_key, Half::open);
  const std::string text = seal_text(store), signature = read_text(signature_path(store));
  const Context context(EVP_MD_CTX_new(), &EVP_MD_CTX_free);
  return EVP_DigestVerifyInit(context.get(), nullptr, nullptr, nullptr, key.get()) == 1 &&
         EVP_DigestVerify(context.get(), bytes_of(signature), signature.size(), bytes_of(text),
                          text.size()) == 1;
}

}  // namespace drape::compare
