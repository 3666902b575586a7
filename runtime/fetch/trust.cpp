#include "trust.hpp"

#include <charconv>

namespace modar::fetch {
namespace {

constexpr std::size_t kMaxSignatureBytes = 4096;
constexpr std::size_t kMaxLinkBytes = 4096;
constexpr std::size_t kMaxLatestBytes = 32;
constexpr std::uint32_t kMaxLinks = 1000;

Result<std::uint64_t> parse_latest(std::string_view text) {
  std::uint64_t version = 0;
  const auto parsed = std::from_chars(text.data(), text.data() + text.size(), version);
  if (parsed.ec != std::errc() || version == 0 ||
      std::string_view(parsed.ptr,
                       static_cast<std::size_t>(text.data() + text.size() - parsed.ptr)) != "\n") {
    return fail(kExitMixed, "fetch.latest", "latest", "it names no release",
                "give the address of a folder that `modar ship publish` filled");
  }
  return version;
}

/// The key that a link of the chain leads to from `trusted`; the same key where the link is signed
/// by another (it lies before the place where this device joined). A chain that ends gives
/// fetch.missing.
Result<PublicKey> follow_link(Transfers& transfers, std::uint32_t serial,
                              const PublicKey& trusted) {
  const std::string path = "keys/" + std::to_string(serial) + ".json";
  const auto text = transfers.text(path, kMaxLinkBytes);
  if (!text) return tl::unexpected(text.error());
  const auto signature_text = transfers.text(path + ".minisig", kMaxSignatureBytes);
  if (!signature_text) return tl::unexpected(signature_text.error());
  const auto signature = parse_signature(*signature_text);
  if (!signature) return tl::unexpected(signature.error());
  if (signature->key_id != trusted.id) return trusted;
  if (auto fine = verify_signature(*text, *signature, trusted); !fine) {
    return tl::unexpected(fine.error());
  }
  const auto link = parse_key_link(*text);
  if (!link) return tl::unexpected(link.error());
  if (link->serial != serial) {
    return fail(kExitMixed, "fetch.chain", path, "it is another link of the chain",
                "publish the chain of keys again");
  }
  return parse_public_key(link->key);
}

/// Moves the trust along the chain until the key of `wanted` is trusted.
Result<void> follow_chain(Transfers& transfers, const Signature& wanted, StoreState& state) {
  auto trusted = parse_public_key(state.trusted_key);
  if (!trusted) return tl::unexpected(trusted.error());
  while (trusted->id != wanted.key_id && state.key_serial < kMaxLinks) {
    auto next = follow_link(transfers, state.key_serial + 1, *trusted);
    if (!next && next.error().code == "fetch.missing") return {};  // verification tells the rest
    if (!next) return tl::unexpected(next.error());
    trusted = *next;
    state.trusted_key = public_key_line(*trusted);
    ++state.key_serial;
  }
  return {};
}

}  // namespace

Result<void> recall_trust(const std::string& given_key, StoreState& state) {
  const auto given = parse_public_key(given_key);
  if (!given) return tl::unexpected(given.error());
  const std::string line = public_key_line(*given);
  if (line == state.root_key || line == state.trusted_key) return {};
  state.root_key = line;
  state.trusted_key = line;
  state.key_serial = 0;
  return {};
}

Result<SignedRelease> bring_release(Transfers& transfers, StoreState& state) {
  const auto latest = transfers.text("latest", kMaxLatestBytes);
  if (!latest) return tl::unexpected(latest.error());
  const auto version = parse_latest(*latest);
  if (!version) return tl::unexpected(version.error());
  const std::string path = "releases/" + std::to_string(*version) + ".json";
  SignedRelease news;
  auto text = transfers.text(path, kMaxReleaseBytes);
  if (!text) return tl::unexpected(text.error());
  auto signature_text = transfers.text(path + ".minisig", kMaxSignatureBytes);
  if (!signature_text) return tl::unexpected(signature_text.error());
  news.text = std::move(*text);
  news.signature_text = std::move(*signature_text);
  const auto signature = parse_signature(news.signature_text);
  if (!signature) return tl::unexpected(signature.error());
  if (auto followed = follow_chain(transfers, *signature, state); !followed) {
    return tl::unexpected(followed.error());
  }
  const auto trusted = parse_public_key(state.trusted_key);
  if (!trusted) return tl::unexpected(trusted.error());
  if (auto fine = verify_signature(news.text, *signature, *trusted); !fine) {
    return tl::unexpected(fine.error());
  }
  auto release = parse_release(news.text);
  if (!release) return tl::unexpected(release.error());
  if (release->version != *version) {
    return fail(kExitMixed, "fetch.mixed", path,
                "it is release " + std::to_string(release->version), "publish the release again");
  }
  news.release = std::move(*release);
  return news;
}

}  // namespace modar::fetch
