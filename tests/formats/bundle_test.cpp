// Writer and view: what goes in comes out, always as the same bytes, and nothing less opens.
#include <gtest/gtest.h>

#include <cstdlib>
#include <cstring>
#include <limits>
#include <type_traits>

#include "formats/base/atomic_file.hpp"
#include "formats/bundle_view.hpp"
#include "formats/check.hpp"
#include "formats/draw_order.hpp"
#include "formats/transport/stages.hpp"
#include "formats/trim.hpp"
#include "tests/formats/allocation_counter.hpp"
#include "tests/formats/support.hpp"

namespace {

using namespace modar;
using namespace modar::test;

template <class T>
void expect_table(const Table<T>& table, const std::vector<T>& records, const char* name) {
  static_assert(std::is_trivially_copyable_v<T>);
  ASSERT_EQ(table.size(), records.size()) << name;
  for (std::uint32_t i = 0; i < table.size(); ++i) {
    EXPECT_EQ(std::memcmp(&table[i], &records[i], sizeof(T)), 0) << name << " " << i;
  }
}

void expect_bytes(std::span<const std::byte> got, std::span<const std::byte> wanted,
                  const char* name) {
  ASSERT_EQ(got.size(), wanted.size()) << name;
  EXPECT_TRUE(std::equal(got.begin(), got.end(), wanted.begin())) << name;
}

TEST(Bundle, RoundTripGivesTheSameContent) {
  BundleContent content = golden_content();
  add_looks(content);
  add_nodes(content);
  const Bytes bytes = encode(content);
  const auto view = BundleView::open(bytes);
  ASSERT_TRUE(view) << to_line(view.error());
  EXPECT_EQ(view->header().file_size, bytes.size());
  EXPECT_EQ(view->meta(), content.meta);
  expect_table(view->models(), content.models, "models");
  expect_table(view->chunks(), content.chunks, "chunks");
  expect_table(view->levels(), content.levels, "levels");
  expect_table(view->materials(), content.materials, "materials");
  expect_table(view->layouts(), content.layouts, "layouts");
  expect_table(view->textures(), content.textures, "textures");
  expect_table(view->texture_levels(), content.texture_levels, "texture levels");
  expect_table(view->patterns(), content.patterns, "patterns");
  expect_table(view->parameter_sets(), content.parameter_sets, "parameter sets");
  expect_table(view->scenes(), content.scenes, "scenes");
  expect_table(view->lights(), content.lights, "lights");
  expect_table(view->occlusion(), content.occlusion, "occlusion");
  expect_table(view->nodes(), content.nodes, "nodes");
  expect_table(view->actions(), content.actions, "actions");
  expect_table(view->media(), content.media, "media");
  expect_bytes(view->media_data(0), content.media_data[0], "media data");
  expect_bytes(view->section(SectionType::kShadow, 1), content.shadows[1], "shadow");
  EXPECT_TRUE(view->section(SectionType::kShadow, 0).empty());
  expect_bytes(view->vertices(), content.vertices, "vertices");
  expect_bytes(view->indices(), content.indices, "indices");
  expect_bytes(view->texture_data(0), content.texture_data[0], "texture data");
  EXPECT_TRUE(view->texture_data(1).empty());
  EXPECT_EQ(view->name(view->models()[1].name), "integer");
  EXPECT_EQ(view->name(view->materials()[1].name), "glass \xC3\xA9");
  for (std::uint32_t p = 0; p < 2; ++p) {
    for (const FeatureContent& wanted : content.features[p]) {
      const FeatureView got = view->features(p, wanted.set_id);
      EXPECT_EQ(got.descriptor_bytes, wanted.descriptor_bytes);
      expect_bytes(std::as_bytes(got.keypoints), std::as_bytes(std::span(wanted.keypoints)),
                   "keypoints");
      expect_bytes(got.descriptors, wanted.descriptors, "descriptors");
      EXPECT_EQ(reinterpret_cast<std::uintptr_t>(got.descriptors.data()) % 8, 0u);
      EXPECT_EQ(view->feature_yml(p, wanted.set_id), wanted.yml);
    }
  }
  EXPECT_EQ(view->features(0, 77).keypoints.size(), 0u);
  expect_bytes(view->section(static_cast<SectionType>(100), 7, 9), content.extra[0].bytes, "extra");
}

TEST(Bundle, ProxiesCountOnFromTheModels) {
  BundleContent content = lit_content();
  EXPECT_EQ(minor_version_of(content), 2);
  add_proxies(content);
  const Bytes bytes = encode(content);
  const auto view = BundleView::open(bytes);
  ASSERT_TRUE(view) << to_line(view.error());
  EXPECT_EQ(view->header().minor, 3);
  expect_table(view->chunks().own(), content.chunks, "chunks");
  expect_table(view->levels().own(), content.levels, "levels");
  ASSERT_EQ(view->chunks().size(), 6u + 4u);
  ASSERT_EQ(view->levels().size(), 9u + 4u);
  ASSERT_EQ(view->chunk_groups(), 3u + 3u);
  const std::uint32_t models[] = {0, 0, 2};
  const std::uint32_t first[] = {6, 8, 9};
  for (std::uint32_t i = 0; i < 3; ++i) {
    const ChunkGroup group = view->chunk_group(3 + i);
    EXPECT_EQ(group.model, models[i]);
    EXPECT_EQ(group.first_chunk, first[i]);
    EXPECT_EQ(group.chunk_count, i == 0 ? 2u : 1u);
    EXPECT_EQ(view->chunks()[group.first_chunk].first_level, first[i] + 3);
  }
  EXPECT_EQ(view->levels()[12].error, 0.25f);
  EXPECT_EQ(view->levels()[8].error, content.levels[8].error);
}

/// A reader that knows none of the three sections: to ours, they are of unknown types.
TEST(Bundle, AReaderWithoutProxiesDrawsTheModels) {
  BundleContent content = lit_content();
  add_proxies(content);
  Bytes bytes = encode(content);
  for (const std::uint32_t type : {72u, 71u, 67u}) {
    entry_of(bytes, static_cast<SectionType>(type)).type = type + 100;
  }
  rehash(bytes);
  const auto view = BundleView::open(bytes);
  ASSERT_TRUE(view) << to_line(view.error());
  expect_table(view->models(), content.models, "models");
  expect_table(view->chunks(), content.chunks, "chunks");
  expect_table(view->levels(), content.levels, "levels");
  EXPECT_EQ(report(bytes).back(), "good");  // with a warning of indices that no level has
}

TEST(Bundle, SectionsAreAlignedForMapping) {
  const Bytes bytes = encode(golden_content());
  const auto view = BundleView::open(bytes);
  ASSERT_TRUE(view);
  for (const SectionEntry& entry : view->sections()) {
    EXPECT_EQ(entry.offset % (entry.type >= 512 ? 4096 : 64), 0u) << entry.type;
  }
  EXPECT_EQ(view->sections().back().offset + view->sections().back().size, bytes.size());
}

TEST(Bundle, TheSameContentGivesTheSameBytes) {
  EXPECT_EQ(encode(golden_content()), encode(golden_content()));
  // Streaming into a file is the same as into memory.
  std::string folder = "/tmp/modar_bundle_XXXXXX";
  ASSERT_NE(mkdtemp(folder.data()), nullptr);
  const std::string path = folder + "/a.modar";
  ASSERT_TRUE(save_bundle(golden_content(), path));
  EXPECT_EQ(read_file(path), encode(golden_content()));
  EXPECT_EQ(std::remove(path.c_str()), 0);
  EXPECT_EQ(std::remove(folder.c_str()), 0);
}

using Nodes = std::span<DrawOrderRecord>;

/// Opens, and is passed by the checker, after `damage` to the draw order.
std::pair<bool, bool> opens_and_passes(void (*damage)(Nodes)) {
  BundleContent content = golden_content();
  add_looks(content);
  ExtraSection& order = content.extra.back();
  damage({reinterpret_cast<DrawOrderRecord*>(order.bytes.data()),
          order.bytes.size() / sizeof(DrawOrderRecord)});
  const Bytes bytes = encode(content);
  return {BundleView::open(bytes).has_value(), check_bundle(bytes, [](const Issue&) {})};
}

TEST(DrawOrder, OnlyATreeOfAllTrianglesPasses) {
  using Answer = std::pair<bool, bool>;
  EXPECT_EQ(opens_and_passes([](Nodes) {}), Answer(true, true));
  EXPECT_EQ(opens_and_passes([](Nodes n) { n[0].behind = 99; }), Answer(false, false));
  EXPECT_EQ(opens_and_passes([](Nodes n) { n[2].triangle = 99; }), Answer(false, false));
  EXPECT_EQ(opens_and_passes([](Nodes n) { n[2].triangle = kNone; }), Answer(false, false));
  EXPECT_EQ(
      opens_and_passes([](Nodes n) { n[3].plane[1] = std::numeric_limits<float>::infinity(); }),
      Answer(false, false));
  // What does no harm to a reader.
  EXPECT_EQ(opens_and_passes([](Nodes n) { n[3].triangle = n[2].triangle; }), Answer(true, false));
  EXPECT_EQ(opens_and_passes([](Nodes n) {
              n[0].behind = 2;
              n[1].behind = static_cast<std::uint32_t>(n.size() - 2);
            }),
            Answer(true, false));
}

TEST(DrawOrder, AWalkEndsOnAnyNodes) {
  // Each node says that all others are behind it.
  std::vector<DrawOrderRecord> nodes(9);
  for (std::uint32_t i = 0; i < nodes.size(); ++i) nodes[i] = {{0, 0, 1, 0}, 99, i};
  std::vector<DrawOrderRange> waiting;
  waiting.reserve(draw_order_depth(nodes.size()));
  const auto* before = waiting.data();
  std::vector<std::uint32_t> seen;
  walk_draw_order(nodes, {0, 0, 1}, waiting, [&](std::uint32_t t) { seen.push_back(t); });
  EXPECT_EQ(seen, (std::vector<std::uint32_t>{8, 7, 6, 5, 4, 3, 2, 1, 0}));
  EXPECT_EQ(waiting.data(), before);
  walk_draw_order(nodes, {0, 0, -1}, waiting, [&](std::uint32_t t) { seen.push_back(t); });
  EXPECT_EQ(seen.size(), 18u);
  EXPECT_EQ(seen.back(), 8u);
}

TEST(Bundle, EmptyTablesHaveNoSection) {
  EXPECT_EQ(encode(BundleContent()).size(), sizeof(FileHeader));
  const Bytes bytes = encode(pattern_content());
  const auto view = BundleView::open(bytes);
  ASSERT_TRUE(view);
  EXPECT_EQ(view->sections().size(), 8u);
  EXPECT_TRUE(view->models().empty());
  EXPECT_TRUE(view->vertices().empty());
}

TEST(Bundle, OpeningAllocatesNothing) {
  const Bytes bytes = encode(golden_content());
  const std::size_t before = allocation_count();
  const bool opened = BundleView::open(bytes).has_value();
  const std::size_t after = allocation_count();
  EXPECT_TRUE(opened);
  EXPECT_EQ(after, before);
}

TEST(Bundle, NoTruncationOpens) {
  for (const BundleContent& content : {pattern_content(), model_content()}) {
    const Bytes whole = encode(content);
    for (std::size_t size = 0; size < whole.size(); ++size) {
      // A copy of just that size, so that a read beyond it is seen.
      const Bytes part(whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(size));
      const auto view = BundleView::open(part);
      ASSERT_FALSE(view) << size;
      ASSERT_EQ(view.error().code, "bundle.truncated") << size;
    }
  }
}

/// The size in the header is corrected: only the ranges inside can tell.
TEST(Bundle, NoRehashedTruncationOpens) {
  const Bytes whole = encode(pattern_content());
  for (std::size_t size = 64 + 8 * 48; size < whole.size(); ++size) {
    Bytes part(whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(size));
    rehash(part);
    ASSERT_FALSE(BundleView::open(part)) << size;
  }
}

TEST(Bundle, AskewBytesAreRefused) {
  Bytes bytes = encode(pattern_content());
  bytes.insert(bytes.begin(), std::byte{0});
  const auto view = BundleView::open(std::span(bytes).subspan(1));
  ASSERT_FALSE(view);
  EXPECT_EQ(view.error().code, "bundle.header");
}

TEST(Bundle, ANewerMinorVersionReads) {
  BundleContent content = pattern_content();
  // Patterns of 72 bytes instead of 64: the last 8 are of a field that this version does not know.
  Bytes longer(16 + 72, std::byte{0x5A});
  const TableHeader header{1, 72, 0};
  std::memcpy(longer.data(), &header, sizeof(header));
  std::memcpy(longer.data() + 16, content.patterns.data(), 64);
  Bytes bytes = encode(content);
  content.patterns.clear();
  content.features.clear();
  content.extra.push_back({48, 1, kSectionRequired, kNone, 0, longer});
  bytes = encode(content);
  EXPECT_EQ(BundleView::open(bytes).error().code, "bundle.table-shape");
  reinterpret_cast<FileHeader*>(bytes.data())->minor = kMinorVersion + 1;
  reinterpret_cast<FileHeader*>(bytes.data())->reserved0 = 1;
  entry_of(bytes, SectionType::kMeta).flags |= 4;
  rehash(bytes);
  const auto view = BundleView::open(bytes);
  ASSERT_TRUE(view) << to_line(view.error());
  EXPECT_EQ(view->patterns()[0].width, 64u);
}

TEST(Bundle, AnotherMajorVersionIsUnsupported) {
  Bytes bytes = encode(pattern_content());
  reinterpret_cast<FileHeader*>(bytes.data())->major = 2;
  rehash(bytes);
  const auto view = BundleView::open(bytes);
  ASSERT_FALSE(view);
  EXPECT_EQ(view.error().exit, ExitCode::kUnsupported);
  EXPECT_EQ(view.error().code, "bundle.version");
  EXPECT_NE(view.error().where.find("byte 8"), std::string::npos);
  EXPECT_FALSE(view.error().cure.empty());
}

TEST(Bundle, SharedIndicesAreRefused) {
  BundleContent content = model_content();
  for (LevelRecord& level : content.levels) level.index_offset = 0;
  content.indices.resize(24);
  const auto view = BundleView::open(encode(content));
  ASSERT_FALSE(view);
  EXPECT_EQ(view.error().code, "bundle.level-range");
}

TEST(Intern, CleansCutsAndShares) {
  BundleContent content;
  const auto text = [&content](NameRef ref) {
    return content.names.substr(ref.offset, ref.length);
  };
  EXPECT_EQ(text(content.intern("spider")), "spider");
  EXPECT_EQ(content.intern("spider").offset, 0u);
  EXPECT_EQ(content.intern("pid").offset, 1u);
  EXPECT_EQ(content.names, "spider");
  EXPECT_EQ(text(content.intern("caf\xE9\n")), "caf\xEF\xBF\xBD\xEF\xBF\xBD");
  const std::string long_name = std::string(1023, 'a') + "\xC3\xA9";
  EXPECT_EQ(text(content.intern(long_name)), std::string(1023, 'a'));
  EXPECT_EQ(content.intern("").length, 0u);
}

TEST(Writer, RefusesContentThatContradictsItself) {
  BundleContent twice = pattern_content();
  twice.features[0].push_back(twice.features[0][0]);
  EXPECT_EQ(encode_bundle(twice).error().code, "bundle.content");
  BundleContent odd = pattern_content();
  odd.features[0][0].descriptors.pop_back();
  EXPECT_EQ(encode_bundle(odd).error().code, "bundle.content");
  BundleContent stray = pattern_content();
  stray.texture_data.resize(1);
  EXPECT_EQ(encode_bundle(stray).error().exit, ExitCode::kInternal);
}

TEST(Writer, StopsWhereTheSinkFails) {
  int calls = 0;
  const auto written =
      write_bundle(golden_content(), [&calls](std::span<const std::byte>) { return ++calls < 5; });
  ASSERT_FALSE(written);
  EXPECT_EQ(written.error().code, "io.write");
  EXPECT_EQ(calls, 5);
}

/// Every section but those that only the paper's method reads, byte by byte.
TEST(Bundle, TrimmedHoldsAllThatPlayersRead) {
  BundleContent content = golden_content();
  add_looks(content);
  ExtraSection record;  // the first pattern's: it is found without its features
  record.type = static_cast<std::uint32_t>(SectionType::kTrackerRecord);
  record.owner = 0;
  record.bytes.assign(96, std::byte{1});
  content.extra.push_back(record);
  const Bytes whole = encode(content);
  const auto before = BundleView::open(whole);
  ASSERT_TRUE(before) << to_line(before.error());
  const Bytes small = encode(trim(*before));
  const auto after = BundleView::open(small);
  ASSERT_TRUE(after) << to_line(after.error());
  std::size_t dropped = 0;
  for (const SectionEntry& entry : before->sections()) {
    const auto type = static_cast<SectionType>(entry.type);
    const auto got = after->section(type, entry.owner, entry.variant);
    const bool twin = type == SectionType::kMappedFeatures || type == SectionType::kFeatureYml;
    if (twin && !before->section(SectionType::kTrackerRecord, entry.owner).empty()) {
      EXPECT_TRUE(got.empty()) << entry.type << " of " << entry.owner;
      ++dropped;
    } else if (type != SectionType::kContentSummary && type != SectionType::kParameterSets) {
      expect_bytes(got, before->section(type, entry.owner, entry.variant),
                   std::to_string(entry.type).c_str());
    }
  }
  EXPECT_GT(dropped, 0u);
  EXPECT_FALSE(after->features(1, content.features[1][0].set_id).keypoints.empty());
  EXPECT_EQ(encode(trim(*after)), small) << "once more changes nothing";
}

/// Its first texture at 512 x 512, all other things of the format too.
BundleContent staged_content() {
  BundleContent content = acting_content();
  add_proxies(content);
  TextureRecord& texture = content.textures[0];
  texture.width = texture.height = 512;
  content.texture_levels.clear();
  texture.level_count = 0;
  Bytes& data = content.texture_data[0];
  data.clear();
  for (std::uint32_t side = 512; side > 0; side /= 2) {
    const std::uint32_t size = 8 * ((side + 3) / 4) * ((side + 3) / 4);
    content.texture_levels.push_back(
        {data.size(), data.size() + size, size, side, side, 30, 0.9f, 0});
    data.resize(data.size() + 2 * size, std::byte(++texture.level_count));
  }
  content.summary.clear();
  return content;
}

TEST(Bundle, ThePreviewNeedsTwoStagesAndIsAGoodBundle) {
  const BundleContent content = staged_content();
  Bytes bytes = encode(content);
  const auto whole = BundleView::open(bytes);
  ASSERT_TRUE(whole) << to_line(whole.error());
  const Bytes wanted = encode(preview(*whole));
  std::size_t late = 0;
  for (const StageRange& range : stage_ranges(*whole)) {
    if (range.stage != LoadStage::kRefine) continue;
    std::fill_n(bytes.begin() + static_cast<std::ptrdiff_t>(range.offset), range.size,
                std::byte{0});
    late += range.size;
  }
  EXPECT_GT(late, 2 * 512u * 512 / 2) << "the finest level and its alpha twin";
  const Bytes got = encode(preview(*BundleView::open(bytes)));
  EXPECT_EQ(got, wanted);
  EXPECT_EQ(report(got), std::vector<std::string>{"good"});
}

TEST(Bundle, AnOnlyLevelIsShownHoweverLarge) {
  BundleContent content = staged_content();
  content.texture_levels.resize(1);
  content.textures[0].level_count = 1;
  const TextureLevelRecord level = content.texture_levels[0];
  content.texture_data[0].resize(level.size * 2);
  const Bytes bytes = encode(content);
  const auto view = BundleView::open(bytes);
  ASSERT_TRUE(view) << to_line(view.error());
  const std::vector<StageRange> shown = shown_blocks(*view, 0);
  ASSERT_EQ(shown.size(), 2u) << "colours and their twin";
  EXPECT_EQ(shown[0].size, level.size);
  EXPECT_EQ(shown_blocks(*BundleView::open(encode(staged_content())), 0).size(), 2u * 9)
      << "256 down to 1";
}

TEST(Bundle, OpensWithoutTwinsThatTheTableHides) {
  BundleContent content = staged_content();
  ExtraSection record;
  record.type = static_cast<std::uint32_t>(SectionType::kTrackerRecord);
  record.owner = 0;
  record.bytes.assign(96, std::byte{1});
  content.extra.push_back(record);
  Bytes bytes = encode(content);
  const auto whole = BundleView::open(bytes);
  ASSERT_TRUE(whole) << to_line(whole.error());
  const Bytes wanted = encode(preview(*whole));
  std::size_t hidden = 0;
  for (const SectionEntry& entry : whole->sections()) {
    const auto type = static_cast<SectionType>(entry.type);
    if (type != SectionType::kMappedFeatures && type != SectionType::kFeatureYml) continue;
    if (entry.owner != 0) continue;
    std::fill_n(bytes.begin() + static_cast<std::ptrdiff_t>(entry.offset), entry.size,
                std::byte{0});
    ++hidden;
  }
  const auto sections = whole->sections().size();
  EXPECT_FALSE(BundleView::open(bytes)) << "a twin without its header";
  const auto start = hide_twins(bytes);
  ASSERT_TRUE(start);
  std::copy(start->begin(), start->end(), bytes.begin());
  const auto rest = BundleView::open(bytes);
  ASSERT_TRUE(rest) << to_line(rest.error());
  EXPECT_EQ(rest->sections().size(), sections - hidden);
  EXPECT_EQ(encode(preview(*rest)), wanted);
  EXPECT_FALSE(hide_twins(std::span(bytes).first(63)));
  EXPECT_FALSE(hide_twins(std::span(bytes).first(64 + 48 * (sections - hidden) - 1)));
}

TEST(Bundle, ThePreviewHoldsProxiesAndSmallTextures) {
  const BundleContent content = staged_content();
  const Bytes bytes = encode(content);
  const Bytes small = encode(preview(*BundleView::open(bytes)));
  const auto view = BundleView::open(small);
  ASSERT_TRUE(view) << to_line(view.error());
  EXPECT_LT(small.size(), bytes.size() / 2);
  // Of models 0 and 2 the coarsest proxies, of 1 all of its own chunks.
  EXPECT_EQ(view->proxies().size(), 0u);
  EXPECT_EQ(view->models()[0].chunk_count, 1u);
  EXPECT_EQ(view->models()[0].triangle_count, 3u);
  EXPECT_EQ(view->models()[1].chunk_count, content.models[1].chunk_count);
  EXPECT_EQ(view->models()[2].triangle_count, 4u);
  EXPECT_EQ(view->models()[0].position_error_max,
            content.models[0].position_error_max + 0.5 * content.models[0].scale);
  const LevelRecord& level = view->levels()[view->chunks()[0].first_level];
  const LevelRecord& proxy = content.proxy_levels[2];
  expect_bytes(view->indices().subspan(level.index_offset, 2ull * level.index_count),
               std::span(content.indices).subspan(proxy.index_offset, 2ull * proxy.index_count),
               "triangles of the proxy");
  EXPECT_EQ(view->textures()[0].width, kShownSide);
  EXPECT_EQ(view->texture_levels()[0].width, kShownSide);
  EXPECT_EQ(view->texture_data(0)[0], std::byte{2}) << "the second level's blocks";
  EXPECT_EQ(view->media().size() + view->actions().size(), 0u);
  EXPECT_EQ(view->nodes().size(), content.nodes.size() - 2) << "without the video and the sound";
  EXPECT_TRUE(view->meta().starts_with(R"({"stage": "show", "tool":"golden")")) << view->meta();
  EXPECT_EQ(view->patterns().size(), content.patterns.size());
}

}  // namespace
