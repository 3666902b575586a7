// Mutates, checks, and asks both readers about what survives.
#include "bake/extensions/lab/mutate.hpp"

#include <cstring>

#include "bake/check/content/content_check.hpp"
#include "bake/check/yml_rule.hpp"
#include "bake/extensions/lab/mutator.hpp"
#include "bake/extensions/lab/scene_digest.hpp"
#include "formats/check.hpp"

namespace modar {
namespace {

/// Mutated files that the second reader gets at a time.
constexpr std::size_t kBatch = 64;

struct Judgement {
  bool killed = false;
  bool summary_only = false;
};

/// The YML rule where the mutation may have broken it: parsing texts takes longer than all else.
bool features_agree(std::span<const std::byte> file, const Mutation& mutation,
                    const IssueSink& sink) {
  const Result<BundleView> view = BundleView::open(file);
  if (!view) return false;
  const std::uint64_t head = sizeof(FileHeader) + view->sections().size_bytes();
  if (mutation.before.empty() || mutation.offset < head) return check_yml_twins(file, sink);
  for (const SectionEntry& entry : view->sections()) {
    const bool features = entry.type == static_cast<std::uint32_t>(SectionType::kMappedFeatures) ||
                          entry.type == static_cast<std::uint32_t>(SectionType::kFeatureYml);
    const bool touched =
        mutation.offset >= entry.offset && mutation.offset < entry.offset + entry.size;
    if (features && touched) return check_yml_twin(file, entry.owner, entry.variant, sink);
  }
  return true;
}

Judgement judge(std::span<const std::byte> file, const Mutation& mutation) {
  bool other = false;
  const IssueSink sink = [&other](const Issue& issue) {
    other = other || (issue.kind->severity == Severity::kError &&
                      std::strcmp(issue.kind->id, "STATEMENT_DIFFERS") != 0);
  };
  Judgement verdict;
  verdict.killed = !check_bundle(file, sink);
  if (!other && !features_agree(file, mutation, sink)) verdict.killed = true;
  const Result<BundleView> bundle = BundleView::open(file);
  if (!other && bundle &&
      !check_content(*bundle, sink, {.first_only = true, .changed = mutation.offset})) {
    verdict.killed = true;
  }
  verdict.summary_only = verdict.killed && !other;
  return verdict;
}

std::string hexadecimal(const std::vector<std::byte>& bytes) {
  constexpr char kDigits[] = "0123456789abcdef";
  std::string text;
  for (const std::byte byte : bytes) {
    text += kDigits[static_cast<unsigned>(byte) >> 4];
    text += kDigits[static_cast<unsigned>(byte) & 15u];
  }
  return text;
}

class Trial {
 public:
  Trial(std::span<const std::byte> bytes, const MutateOptions& options)
      : bytes_(bytes), options_(options), mutator_(bytes, options.seed) {
    scene_ = scene_digest(bytes);
  }

  Result<MutationReport> run() {
    for (std::uint64_t i = 0; i < options_.count; ++i) {
      if (options_.progress && i % 256 == 0) {
        options_.progress(static_cast<double>(i) / static_cast<double>(options_.count));
      }
      try_one(i);
      if (candidates_.size() < kBatch) continue;
      MODAR_TRY(ask_second_reader());
    }
    MODAR_TRY(ask_second_reader());
    report_.n = options_.count;
    return std::move(report_);
  }

 private:
  struct Candidate {
    Mutation mutation;
    std::uint64_t number = 0;
    std::vector<std::byte> file;
  };

  template <class Work>
  void tally(const Mutation& mutation, Work work) {
    work(mutation.rehashed ? report_.rehashed : report_.unhashed);
    work(report_.by_kind[mutation.kind]);
    if (mutation.rehashed && !mutation.field.empty()) work(report_.by_field[mutation.field]);
  }

  void try_one(std::uint64_t number) {
    const Mutation mutation = mutator_.next(number % 4 != 0);
    const Judgement verdict = judge(mutator_.file(), mutation);
    tally(mutation, [&](MutationTally& t) {
      ++t.tried;
      t.killed += verdict.killed ? 1 : 0;
      t.summary += verdict.summary_only ? 1 : 0;
    });
    if (!verdict.killed) {
      // Ours first: what it sees changed need not be asked about.
      if (!options_.second_reader.empty() && scene_digest(mutator_.file()) == scene_) {
        const auto file = mutator_.file();
        candidates_.push_back({mutation, number, {file.begin(), file.end()}});
      } else {
        survive(mutation, number);
      }
    }
    mutator_.undo();
  }

  void survive(const Mutation& mutation, std::uint64_t number) {
    if (report_.survivors.size() >= kMaxSurvivors) return;
    report_.survivors.push_back({number, mutation.kind, mutation.field, mutation.offset,
                                 hexadecimal(mutation.before), hexadecimal(mutation.after),
                                 mutation.rehashed});
  }

  Result<void> ask_second_reader() {
    if (candidates_.empty()) return {};
    std::vector<std::span<const std::byte>> files{bytes_};
    for (const Candidate& candidate : candidates_) files.emplace_back(candidate.file);
    MODAR_ASSIGN(const auto scenes, read_scenes(options_.second_reader, files));
    for (std::size_t i = 0; i < candidates_.size(); ++i) {
      const Candidate& candidate = candidates_[i];
      if (scenes[i + 1] == scenes[0]) {
        tally(candidate.mutation, [](MutationTally& t) { ++t.harmless; });
      } else {
        survive(candidate.mutation, candidate.number);
      }
    }
    candidates_.clear();
    return {};
  }

  std::span<const std::byte> bytes_;
  const MutateOptions& options_;
  Mutator mutator_;
  std::uint64_t scene_ = 0;
  std::vector<Candidate> candidates_;
  MutationReport report_;
};

double share(std::uint64_t part, std::uint64_t whole) {
  return whole == 0 ? 1.0 : static_cast<double>(part) / static_cast<double>(whole);
}

}  // namespace

double MutationTally::rate() const {
  return share(killed, tried - harmless);
}

double MutationTally::rate_without_summary() const {
  return share(killed - summary, tried - harmless);
}

Result<MutationReport> mutate_bundle(std::span<const std::byte> bytes,
                                     const MutateOptions& options) {
  const IssueSink ignore = [](const Issue&) {};
  MODAR_TRY(BundleView::open(bytes));
  if (!check_bundle(bytes, ignore) || !check_yml_twins(bytes, ignore)) {
    return fail(ExitCode::kInvalidInput, "mutate.bad", "bundle",
                "the bundle fails validation before any mutation",
                "run modar check and bake it again");
  }
  return Trial(bytes, options).run();
}

}  // namespace modar
