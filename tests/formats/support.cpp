// What it takes to damage a bundle with intent, and to report its faults.
#include "tests/formats/support.hpp"

#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <iterator>

#include "formats/check.hpp"

#define XXH_INLINE_ALL
#include <xxhash.h>

namespace modar::test {
namespace {

[[noreturn]] void end(const char* why) {
  std::fprintf(stderr, "%s\n", why);
  std::abort();
}

}  // namespace

Bytes encode(const BundleContent& content) {
  auto bytes = encode_bundle(content);
  if (!bytes) end(to_line(bytes.error()).c_str());
  return std::move(*bytes);
}

SectionEntry& entry_of(Bytes& bytes, SectionType type) {
  const auto& header = *reinterpret_cast<const FileHeader*>(bytes.data());
  auto* entries = reinterpret_cast<SectionEntry*>(bytes.data() + sizeof(FileHeader));
  for (std::uint32_t i = 0; i < header.section_count; ++i) {
    if (entries[i].type == static_cast<std::uint32_t>(type)) return entries[i];
  }
  end("the section is not there");
}

void rehash(Bytes& bytes) {
  auto& header = *reinterpret_cast<FileHeader*>(bytes.data());
  auto* entries = reinterpret_cast<SectionEntry*>(bytes.data() + sizeof(FileHeader));
  header.file_size = bytes.size();
  for (std::uint32_t i = 0; i < header.section_count; ++i) {
    const SectionEntry& entry = entries[i];
    if (entry.offset > bytes.size() || entry.size > bytes.size() - entry.offset) continue;
    entries[i].hash = XXH64(bytes.data() + entry.offset, entry.size, 0);
  }
  std::vector<std::byte> hashed(bytes.begin(), bytes.begin() + offsetof(FileHeader, hash));
  const auto table = bytes.begin() + sizeof(FileHeader);
  hashed.insert(hashed.end(), table,
                table + static_cast<std::ptrdiff_t>(header.section_count * sizeof(SectionEntry)));
  header.hash = XXH64(hashed.data(), hashed.size(), 0);
}

std::vector<std::string> report(std::span<const std::byte> bytes) {
  std::vector<std::string> lines;
  const bool good = check_bundle(bytes, [&lines](const Issue& issue) {
    const char* severities[] = {"error", "warning", "info"};
    lines.push_back(std::string(severities[static_cast<int>(issue.kind->severity)]) + " " +
                    issue.kind->id + " " + issue.where + " (byte " + std::to_string(issue.offset) +
                    "): " + issue.detail);
  });
  lines.push_back(good ? "good" : "bad");
  return lines;
}

Bytes read_file(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  const std::string text{std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
  const auto bytes = std::as_bytes(std::span(text));
  return {bytes.begin(), bytes.end()};
}

std::string source_path(const std::string& relative) {
  const char* root = std::getenv("MODAR_SOURCE_DIR");
  return std::string(root != nullptr ? root : ".") + "/" + relative;
}

std::vector<IssueKind> issue_kinds() {
  std::vector<IssueKind> all;
  for (const auto part : {opening_issue_kinds(), content_issue_kinds()}) {
    all.insert(all.end(), part.begin(), part.end());
  }
  return all;
}

}  // namespace modar::test
