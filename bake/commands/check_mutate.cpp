// `modar check --mutate N`: how many of N damaged copies of a bundle the checker finds bad.
#include <cstdio>
#include <string>

#include "bake/commands/check_command.hpp"
#include "bake/lab/mutate.hpp"
#include "bake/terminal.hpp"
#include "modar/mapped_file.hpp"

namespace modar {
namespace {

/// The goals that the checker is held to.
constexpr double kUnhashedGoal = 1.0;
constexpr double kRehashedGoal = 0.995;

void print_tally(const std::string& name, const MutationTally& tally) {
  std::printf("%-28s %8llu tried, %8llu killed, %6llu harmless: %7.3f %%\n", name.c_str(),
              static_cast<unsigned long long>(tally.tried),
              static_cast<unsigned long long>(tally.killed),
              static_cast<unsigned long long>(tally.harmless), 100 * tally.rate());
}

void print_report(const MutationReport& report) {
  print_tally("without true hashes", report.unhashed);
  print_tally("with true hashes", report.rehashed);
  std::printf("%-28s %7.3f %%\n", "... by all rules but one",
              100 * report.rehashed.rate_without_summary());
  for (const auto& [kind, tally] : report.by_kind) print_tally("  " + kind, tally);
  for (const MutationSurvivor& survivor : report.survivors) {
    std::printf("survived: %s of %s at byte %llu: %s became %s\n", survivor.kind.c_str(),
                survivor.field.empty() ? "the file" : survivor.field.c_str(),
                static_cast<unsigned long long>(survivor.offset), survivor.before.c_str(),
                survivor.after.c_str());
  }
}

}  // namespace

int run_mutate(const CheckCommand& command) {
  const Result<MappedFile> file = MappedFile::open(command.bundle);
  if (!file) return print_error(file.error());
  ProgressBar bar(command.json);
  MutateOptions options;
  options.count = command.mutations;
  options.seed = command.seed;
  options.second_reader = command.second_reader;
  options.progress = [&bar](double done) { bar.show("mutate", done); };
  const Result<MutationReport> report = mutate_bundle(file->bytes(), options);
  bar.clear();
  if (!report) return print_error(report.error());
  if (command.json) {
    std::fputs(mutation_json(*report).c_str(), stdout);
  } else {
    print_report(*report);
  }
  const bool proven =
      report->unhashed.rate() >= kUnhashedGoal && report->rehashed.rate() >= kRehashedGoal;
  return static_cast<int>(proven ? ExitCode::kOk : ExitCode::kInvalidInput);
}

}  // namespace modar
