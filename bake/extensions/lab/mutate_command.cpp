// `modar-lab mutate`: how many of N damaged copies of a bundle the checker finds bad.
#include <cstdio>
#include <memory>
#include <string>

#include "bake/extensions/lab/commands.hpp"
#include "bake/extensions/lab/mutate.hpp"
#include "bake/io/terminal.hpp"
#include "bake/json.hpp"
#include "modar/mapped_file.hpp"

namespace modar {
namespace {

struct MutateCommand {
  std::string bundle;
  MutateOptions options;
  bool json = false;
};

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

Json tally_json(const MutationTally& tally) {
  return {{"tried", tally.tried},
          {"killed", tally.killed},
          {"harmless", tally.harmless},
          {"rate", tally.rate()}};
}

std::string mutation_json(const MutationReport& report) {
  Json kinds = Json::object();
  for (const auto& [kind, tally] : report.by_kind) kinds.set(kind, tally_json(tally));
  Json fields = Json::object();
  for (const auto& [field, tally] : report.by_field) {
    Json one = tally_json(tally);
    one.set("rate_without_statement", tally.rate_without_summary());
    fields.set(field, std::move(one));
  }
  Json survivors = Json::array();
  for (const MutationSurvivor& survivor : report.survivors) {
    survivors.push_back({{"number", survivor.number},
                         {"kind", survivor.kind},
                         {"rehashed", survivor.rehashed},
                         {"field", survivor.field},
                         {"offset", survivor.offset},
                         {"before", survivor.before},
                         {"after", survivor.after}});
  }
  const Json document = {
      {"mutation",
       {{"n", report.n},
        {"rate_unhashed", report.unhashed.rate()},
        {"rate_rehashed", report.rehashed.rate()},
        {"rate_rehashed_without_statement", report.rehashed.rate_without_summary()},
        {"harmless", report.unhashed.harmless + report.rehashed.harmless},
        {"by_kind", kinds},
        {"by_field", fields},
        {"survivors", survivors}}}};
  return document.dump();
}

Result<ExitCode> run_mutate(const MutateCommand& command) {
  MODAR_ASSIGN(const MappedFile file, MappedFile::open(command.bundle));
  ProgressBar bar(command.json);
  MutateOptions options = command.options;
  options.progress = [&bar](double done) { bar.show("mutate", done); };
  const Result<MutationReport> report = mutate_bundle(file.bytes(), options);
  bar.clear();
  if (!report) return tl::unexpected(report.error());
  if (command.json) {
    std::fputs(mutation_json(*report).c_str(), stdout);
  } else {
    print_report(*report);
  }
  const bool proven =
      report->unhashed.rate() >= kUnhashedGoal && report->rehashed.rate() >= kRehashedGoal;
  return proven ? ExitCode::kOk : ExitCode::kInvalidInput;
}

}  // namespace

void add_mutate(CommandLine& program) {
  CommandLine& line =
      program.command("mutate", "Damage copies of a bundle and count how many the checker finds");
  const auto command = std::make_shared<MutateCommand>();
  command->options.count = 100000;
  line.option("bundle", &command->bundle, "The bundle, a good one",
              {.type = "BUNDLE", .required = true});
  line.option("--count", &command->options.count, "Damaged copies",
              {.type = "N", .shows_default = true, .positive = true});
  line.option("--seed", &command->options.seed, "Random seed of the damage",
              {.shows_default = true});
  line.option("--second-reader", &command->options.second_reader,
              "scripts/read_bundle.py, which decides which unnoticed changes have no effect",
              {.type = "FILE"});
  line.flag("--json", command->json, "Print the counts as JSON");
  line.footer(example("  modar-lab mutate spider.modar --second-reader scripts/read_bundle.py\n",
                      ". 3 as well where fewer\nare found than the goals ask for: all with wrong "
                      "hashes, 99.5 % with true ones"));
  line.run([command] { return run_mutate(*command); });
}

}  // namespace modar
