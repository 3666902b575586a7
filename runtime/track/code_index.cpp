// Inverted file of all patterns' codes, and the agreement of a frame's features on a place.
#include "code_index.hpp"

#include <algorithm>
#include <cmath>

namespace modar::tracker {
namespace {

constexpr std::size_t kIndexed = 128;    // codes of a pattern and polarity
constexpr int kFarthest = 60;            // bits; no code further away says anything
constexpr std::size_t kHypotheses = 64;  // votes of a pattern that the others are held against
constexpr std::uint32_t kNobody = ~0u;
constexpr unsigned kWordBits = 20;  // of a word's number, below its distance
constexpr int kWholeReach = 255;    // of Kernels::distances(): leaves nothing out
constexpr std::size_t kBlockBytes = std::size_t{kBlockCodes} * kCodeBytes;

using Code = CodeIndex::Code;

Code code_at(const std::uint8_t* blocks, std::size_t i) {
  const std::uint8_t* block = blocks + i / kBlockCodes * kBlockBytes + i % kBlockCodes;
  Code code;
  for (std::size_t k = 0; k < code.size(); ++k) code[k] = block[k * kBlockCodes];
  return code;
}

void put_code(const Code& code, std::size_t i, std::uint8_t* blocks) {
  std::uint8_t* block = blocks + i / kBlockCodes * kBlockBytes + i % kBlockCodes;
  for (std::size_t k = 0; k < code.size(); ++k) block[k * kBlockCodes] = code[k];
}

std::size_t position_of(std::span<const std::uint8_t> distances, int wanted) {
  std::size_t at = 0;
  while (at + 1 < distances.size() && distances[at] != wanted) ++at;
  return at;
}

/// Where a pattern's features of a polarity begin and end.
std::array<std::size_t, 2> range_of(const TrackedPattern& pattern, bool dark) {
  if (dark) return {pattern.bright_count, pattern.features.size()};
  return {0, pattern.bright_count};
}

}  // namespace

CodeIndex::CodeIndex(std::span<const TrackedPattern> patterns, const Kernels& kernels,
                     std::size_t most_features)
    : patterns_(patterns),
      kernels_(kernels),
      votes_(most_features),
      last_(patterns.size()),
      support_(patterns.size()) {
  build(groups_[0], false);
  build(groups_[1], true);
}

void CodeIndex::build(Group& group, bool dark) {
  std::vector<Code> codes;
  std::vector<std::uint32_t> owners;
  for (std::uint32_t p = 0; p < patterns_.size(); ++p) {
    const auto [first, last] = range_of(patterns_[p], dark);
    for (std::size_t i = first; i < std::min(last, first + kIndexed); ++i) {
      codes.push_back(code_at(patterns_[p].codes, i));
      owners.push_back(p * static_cast<std::uint32_t>(kIndexed) +
                       static_cast<std::uint32_t>(i - first));
    }
  }
  if (codes.empty()) return;
  // As many words as make comparing with them and with some of their lists cost about the same.
  const double balanced = std::sqrt(2.0 * static_cast<double>(codes.size()));
  const std::size_t words = (static_cast<std::size_t>(balanced) / kBlockCodes + 1) * kBlockCodes;
  group.words.resize(words * kCodeBytes);
  for (std::size_t w = 0; w < words; ++w) {
    put_code(codes[w * codes.size() / words], w, group.words.data());
  }
  distances_.resize(std::max(distances_.size(), words + kSlack));
  std::vector<std::vector<std::uint32_t>> lists(words);
  for (std::uint32_t i = 0; i < codes.size(); ++i) {
    const int least = kernels_.distances(codes[i].data(), group.words.data(), words / kBlockCodes,
                                         kWholeReach, distances_.data());
    lists[position_of({distances_.data(), words}, least)].push_back(i);
  }
  for (const std::vector<std::uint32_t>& list : lists) {
    group.starts.push_back(static_cast<std::uint32_t>(group.owners.size() / kBlockCodes));
    const std::size_t filled = (list.size() + kBlockCodes - 1) / kBlockCodes * kBlockCodes;
    group.codes.resize((group.owners.size() + filled) * kCodeBytes);
    for (std::size_t k = 0; k < filled; ++k) {
      const std::uint32_t i = list[std::min(k, list.size() - 1)];  // filled up by its last
      put_code(codes[i], group.owners.size(), group.codes.data());
      group.owners.push_back(owners[i]);
    }
    distances_.resize(std::max(distances_.size(), filled + kSlack));
  }
  group.starts.push_back(static_cast<std::uint32_t>(group.owners.size() / kBlockCodes));
  group.codes.shrink_to_fit();
  group.owners.shrink_to_fit();
}

/// The words nearest to a code that have any codes, by distance and number, then kNobody.
std::array<std::uint32_t, CodeIndex::kProbes> CodeIndex::near_words(const Group& group,
                                                                    const Code& code) {
  const std::size_t words = group.starts.size() - 1;
  kernels_.distances(code.data(), group.words.data(), words / kBlockCodes, kWholeReach,
                     distances_.data());
  std::array<std::uint32_t, kProbes> near;
  near.fill(kNobody);
  for (std::uint32_t w = 0; w < words; ++w) {
    std::uint32_t key = std::uint32_t{distances_[w]} << kWordBits | w;
    if (key >= near.back() || group.starts[w] == group.starts[w + 1]) continue;
    for (std::uint32_t& other : near) {
      if (key < other) std::swap(key, other);
    }
  }
  return near;
}

/// The owner of the nearest code in the lists of the nearest words; kNobody where none is near.
std::uint32_t CodeIndex::nearest_owner(const Group& group, const Code& code) {
  std::uint32_t owner = kNobody;
  int best = kFarthest + 1;
  for (const std::uint32_t key : near_words(group, code)) {
    if (key == kNobody) break;
    const std::uint32_t word = key & ((1u << kWordBits) - 1);
    const std::size_t first = std::size_t{group.starts[word]} * kBlockCodes;
    const std::size_t blocks = group.starts[word + 1] - group.starts[word];
    const int least = kernels_.distances(code.data(), group.codes.data() + first * kCodeBytes,
                                         blocks, best, distances_.data());
    if (least >= best) continue;
    best = least;
    owner = group.owners[first + position_of({distances_.data(), blocks * kBlockCodes}, least)];
  }
  return owner;
}

/// The most votes of a pattern that agree on a place; last: its last vote.
CodeIndex::Support CodeIndex::agreeing(std::uint32_t last, std::size_t count) const {
  Support most;
  const std::size_t stride = count / kHypotheses + 1;
  std::size_t k = 0;
  for (std::uint32_t i = last; i != kNobody; i = votes_[i].before, ++k) {
    if (k % stride != 0) continue;
    std::uint16_t agree = 0;
    for (std::uint32_t j = last; j != kNobody; j = votes_[j].before) {
      if (agrees(votes_[i].match, votes_[j].match)) ++agree;
    }
    if (agree > most.votes) most = {agree, votes_[i].match};
  }
  return most;
}

std::span<const CodeIndex::Support> CodeIndex::vote(std::span<const TrackerFeature> features) {
  std::fill(support_.begin(), support_.end(), Support{});
  std::fill(last_.begin(), last_.end(), kNobody);
  std::uint32_t count = 0;
  for (const TrackerFeature& feature : features.first(std::min(features.size(), votes_.size()))) {
    const bool dark = feature.dark != 0;
    const Group& group = groups_[dark ? 1 : 0];
    if (group.starts.empty()) continue;
    const std::uint32_t owner = nearest_owner(group, feature.code);
    if (owner == kNobody) continue;
    const std::uint32_t p = owner / kIndexed;
    const std::size_t at = range_of(patterns_[p], dark)[0] + owner % kIndexed;
    votes_[count] = {last_[p], match_of(patterns_[p].features[at], feature)};
    last_[p] = count++;
    ++support_[p].votes;
  }
  for (std::size_t p = 0; p < support_.size(); ++p) {
    support_[p] = agreeing(last_[p], support_[p].votes);
  }
  return support_;
}

}  // namespace modar::tracker
