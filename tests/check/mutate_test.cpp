// The proof of the checker is worth something only if its mutations reach everything.
#include "bake/extensions/lab/mutate.hpp"

#include <gtest/gtest.h>

#include <set>
#include <string>

#include "bake/extensions/lab/mutator.hpp"
#include "bake/extensions/lab/scene_digest.hpp"
#include "formats/check.hpp"
#include "formats/content_summary.hpp"
#include "tests/formats/support.hpp"
#include "tests/soak.hpp"

namespace {

using namespace modar;
using namespace modar::test;

/// All of the format, with a content summary.
Bytes summarised_bundle() {
  BundleContent content = golden_content();
  add_looks(content);
  add_nodes(content);
  add_proxies(content);
  content.summary = content_summary_of(content);
  return encode(content);
}

/// Moving models have no proxies.
Bytes moving_bundle() {
  BundleContent content = golden_content();
  add_looks(content);
  add_clips(content);
  content.summary = content_summary_of(content);
  return encode(content);
}

TEST(Mutate, ReachesItsGoals) {
  MutateOptions options;
  options.count = modar::testing::soak() ? 100000 : 6000;
  options.second_reader = source_path("scripts/read_bundle.py");
  auto report = mutate_bundle(summarised_bundle(), options);
  ASSERT_TRUE(report) << to_line(report.error());
  EXPECT_EQ(report->n, options.count);
  EXPECT_EQ(report->unhashed.tried + report->rehashed.tried, options.count);
  EXPECT_EQ(report->unhashed.rate(), 1.0);
  EXPECT_GE(report->rehashed.rate(), 0.999);
  // Orders that no sum shows: every one is noticed.
  for (const char* kind :
       {"vertices swapped", "vertices rotated", "triangles swapped", "triangles flipped",
        "blocks swapped", "blocks rotated", "descriptors swapped"}) {
    const MutationTally& tally = report->by_kind[kind];
    EXPECT_GT(tally.tried, 10u) << kind;
    EXPECT_EQ(tally.killed + tally.harmless, tally.tried) << kind;
  }
  // Few can be harmless: most of what a file says matters.
  EXPECT_LT(report->rehashed.harmless, report->rehashed.tried / 50);
  for (const MutationSurvivor& s : report->survivors) {
    EXPECT_TRUE(s.rehashed) << s.kind << " of " << s.field << " at " << s.offset;
  }
}

TEST(Mutate, SpreadsOverEveryFieldOfTheSpecification) {
  std::set<std::string> names;
  for (const Bytes& bytes : {summarised_bundle(), moving_bundle()}) {
    const auto view = BundleView::open(bytes);
    ASSERT_TRUE(view);
    std::set<std::string> own;
    for (const MutationField& field : mutation_fields(*view)) {
      EXPECT_TRUE(own.insert(field.name).second) << field.name;
      EXPECT_GT(field.elements(), 0u) << field.name;
      const std::size_t size = field_element_bytes(field.type);
      EXPECT_LE(field.place(field.elements() - 1) + size, bytes.size()) << field.name;
    }
    names.merge(own);
  }
  for (const RecordInfo& record : record_infos()) {
    for (const FieldInfo& field : record.fields) {
      if (field.type == FieldType::kAttributes) continue;  // an AttributeRecord each
      EXPECT_TRUE(names.contains(std::string(record.name) + "." + field.name))
          << record.name << "." << field.name;
    }
  }
  for (const char* payload :
       {"names", "meta", "statement", "feature text", "descriptor", "texture block", "index",
        "vertex position", "vertex normal", "vertex octahedral normal", "vertex uv",
        "vertex colour", "vertex occlusion", "vertex padding", "pattern colour", "shadow texel",
        "padding between sections"}) {
    EXPECT_TRUE(names.contains(payload)) << payload;
  }
}

TEST(Mutate, EveryMutationChangesTheFileAndIsTakenBack) {
  const Bytes bytes = summarised_bundle();
  Mutator mutator(bytes, 5);
  for (int i = 0; i < 2000; ++i) {
    const Mutation mutation = mutator.next(i % 2 == 0);
    const auto file = mutator.file();
    EXPECT_FALSE(std::equal(file.begin(), file.end(), bytes.begin(), bytes.end()))
        << mutation.kind << " of " << mutation.field;
    mutator.undo();
    ASSERT_TRUE(
        std::equal(mutator.file().begin(), mutator.file().end(), bytes.begin(), bytes.end()))
        << mutation.kind << " of " << mutation.field;
  }
}

/// Rehashed field edits get past the hashes: those that die do so by the rules.
TEST(Mutate, RehashedMutationsHaveTrueHashes) {
  const Bytes bytes = summarised_bundle();
  Mutator mutator(bytes, 6);
  int hash_faults = 0;
  int fields = 0;
  for (int i = 0; i < 1000; ++i) {
    const Mutation mutation = mutator.next(true);
    // Edits of the table's own fields may make it state other bytes than there are.
    if (!mutation.before.empty() && mutation.offset >= 64 + 48 * 20) {
      ++fields;
      check_bundle(mutator.file(), [&](const Issue& issue) {
        const std::string id = issue.kind->id;
        hash_faults += id == "SECTION_HASH" || id == "BUNDLE_HEADER_HASH" ? 1 : 0;
      });
    }
    mutator.undo();
  }
  EXPECT_GT(fields, 700);
  EXPECT_EQ(hash_faults, 0);
}

TEST(Mutate, TheSameSeedGivesTheSameReport) {
  MutateOptions options;
  options.count = 400;
  const Bytes bytes = summarised_bundle();
  const auto one = mutate_bundle(bytes, options);
  const auto two = mutate_bundle(bytes, options);
  options.seed = 2;
  const auto other = mutate_bundle(bytes, options);
  ASSERT_TRUE(one && two && other);
  EXPECT_EQ(one->rehashed.killed, two->rehashed.killed);
  EXPECT_EQ(one->survivors.size(), two->survivors.size());
  const auto counts = [](const MutationReport& report) {
    std::string text;
    for (const auto& [field, tally] : report.by_field) {
      text += field + "=" + std::to_string(tally.tried) + " ";
    }
    return text;
  };
  EXPECT_EQ(counts(*one), counts(*two));
  EXPECT_NE(counts(*one), counts(*other));
}

TEST(Mutate, ASceneIsTheSameOnlyWhereAllThatIsSeenIs) {
  const Bytes bytes = summarised_bundle();
  const std::uint64_t scene = scene_digest(bytes);
  Bytes meta = bytes;
  meta[entry_of(meta, SectionType::kMeta).offset] ^= std::byte{1};
  rehash(meta);
  EXPECT_EQ(scene_digest(meta), scene);
  for (const SectionType type :
       {SectionType::kNames, SectionType::kModels, SectionType::kVertices, SectionType::kIndices,
        SectionType::kTextureData, SectionType::kMappedFeatures, SectionType::kScenes}) {
    Bytes changed = bytes;
    const SectionEntry& entry = entry_of(changed, type);
    const std::size_t at = type == SectionType::kNames || type == SectionType::kVertices ||
                                   type == SectionType::kIndices ||
                                   type == SectionType::kTextureData
                               ? 0
                               : 40;
    changed[entry.offset + at] ^= std::byte{1};
    rehash(changed);
    EXPECT_NE(scene_digest(changed), scene) << static_cast<int>(type);
  }
}

TEST(Mutate, RefusesABundleThatIsBadAlready) {
  Bytes bytes = summarised_bundle();
  record_of<MaterialRecord>(bytes, SectionType::kMaterials).opacity = 3;
  rehash(bytes);
  MutateOptions options;
  options.count = 1;
  const auto report = mutate_bundle(bytes, options);
  ASSERT_FALSE(report);
  EXPECT_EQ(report.error().code, "mutate.bad");
}

TEST(Mutate, SaysWhatIsWrongWithASecondReaderThatIsNotThere) {
  MutateOptions options;
  options.count = 3000;  // enough for a harmless one
  options.second_reader = "/nowhere/read_bundle.py";
  // A summary would have found every one.
  const auto report = mutate_bundle(encode(golden_content()), options);
  ASSERT_FALSE(report);
  EXPECT_EQ(report.error().code, "mutate.second-reader");
}

}  // namespace
