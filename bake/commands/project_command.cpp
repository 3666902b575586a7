// Collections: `modar bake` of a modar.toml, `modar init`, `modar cache`.
#include "bake/commands/project_command.hpp"

#include <sys/stat.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <set>
#include <thread>

#include "bake/bundle/bundle_json.hpp"
#include "bake/commands/commands.hpp"
#include "bake/io/input.hpp"
#include "bake/io/output.hpp"
#include "bake/io/terminal.hpp"
#include "bake/memory/memory_limit.hpp"
#include "bake/process/process.hpp"
#include "bake/project/project.hpp"
#include "formats/base/atomic_file.hpp"
#include "formats/base/path.hpp"
#include "formats/bundle_view.hpp"
#include "modar/mapped_file.hpp"

namespace modar {

void print_scenes(const BundleView& bundle) {
  constexpr std::uint32_t kMostLines = 12;
  const std::uint32_t count = bundle.scenes().size();
  for (std::uint32_t s = 0; s < std::min(count, kMostLines); ++s) {
    const SceneRecord& scene = bundle.scenes()[s];
    const std::string name = std::string(bundle.name(bundle.patterns()[scene.pattern].name)) + "=" +
                             std::string(bundle.name(bundle.models()[scene.model].name));
    std::fprintf(stderr, "scene   %-16s %s%s\n", name.c_str(), scene_words(bundle, s).c_str(),
                 s == 0 ? "; turn=180 if that is its back; up= and height= change the rest" : "");
  }
  if (count > kMostLines) {
    std::fprintf(stderr, "scene   and %u more: `modar inspect` lists them\n", count - kMostLines);
  }
}
namespace {

using State = AssetOutcome::State;

constexpr const char* kProjectWords[] = {"--project", "--cache",   "--cache-key",    "--outside",
                                         "--asset",   "--depfile", "--dry-run",      "--explain",
                                         "--jobs",    "--memory",  "--quiet",        "--json",
                                         "--watch",   "--notes",   "--progress-json"};

/// Options of the bake on the command line would be ignored with a project file.
Result<void> refuse_other_options(const std::vector<std::string>& words) {
  for (const std::string& word : words) {
    const std::string name = word.substr(0, word.find('='));
    if (!name.starts_with("-") || std::find(std::begin(kProjectWords), std::end(kProjectWords),
                                            name) != std::end(kProjectWords)) {
      continue;
    }
    return fail(
        ExitCode::kUsage, "bake.project-option", name,
        "without --model and --pattern a project is baked, which sets this in its file",
        name == "-o" || name == "--output" ? "set out and name in [project]" : "set it in [bake]");
  }
  return {};
}

const char* state_name(State state) {
  constexpr const char* kNames[] = {"fresh", "cached", "baked", "failed", "stale"};
  return kNames[static_cast<std::size_t>(state)];
}

/// A path in a makefile: blanks, "#" and "$" would end or change it.
std::string make_quoted(const std::string& path) {
  std::string out;
  for (const char c : path) {
    if (c == ' ' || c == '#') out += '\\';
    if (c == '$') out += '$';
    out += c;
  }
  return out;
}

/// Rules of make. The target of an asset alone is the depfile without its extension: the stamp of
/// `modar plan`.
Result<void> write_depfile(const std::string& path, const ProjectOutcome& outcome) {
  std::string text;
  for (const BundleOutcome& bundle : outcome.bundles) text += make_quoted(bundle.path) + " ";
  if (outcome.bundles.empty()) text = make_quoted(path.substr(0, path.rfind('.'))) + " ";
  text += ":";
  for (const std::string& input : outcome.inputs) text += " \\\n  " + make_quoted(input);
  return write_file(path, std::string_view(text + "\n"));
}

/// Our depfiles name their targets in a line of their own; those of compilers name inputs
/// there.
Result<void> keep_no_depfile(const std::string& path) {
  return keep_other_kinds(path, "depfile of modar", [](std::string_view start) {
    return start.substr(0, start.find('\n')).ends_with(": \\") && !start.starts_with(' ');
  });
}

Json project_json(const ProjectOutcome& outcome) {
  const Json assets = Json::list(outcome.assets, [&](const AssetOutcome& asset) -> Json {
    return {{"name", asset.name},
            {"tier", asset.tier},
            {"state", state_name(asset.state)},
            {"reason", asset.reason}};
  });
  const Json bundles = Json::list(outcome.bundles, [&](const BundleOutcome& bundle) -> Json {
    return {{"path", bundle.path}, {"bytes", bundle.bytes}, {"written", bundle.written}};
  });
  const Json errors = Json::list(outcome.errors, [&](const Error& error) -> Json {
    return {
        {"code", error.code}, {"where", error.where}, {"cause", error.cause}, {"cure", error.cure}};
  });
  const ProcessCost cost = process_cost();
  return {{"assets", assets},
          {"bundles", bundles},
          {"findings", diagnostics_json(outcome.diagnostics)},
          {"errors", errors},
          {"cpu_seconds", cost.cpu_seconds},
          {"peak_rss_bytes", cost.peak_rss_bytes}};
}

/// "3 baked, 409 from the cache", the counts that are not 0.
std::string counts_of(const ProjectOutcome& outcome) {
  std::size_t counts[5] = {};
  for (const AssetOutcome& asset : outcome.assets) ++counts[static_cast<std::size_t>(asset.state)];
  const auto count = [&](State state) { return counts[static_cast<std::size_t>(state)]; };
  std::string text =
      std::to_string(outcome.assets.size()) + (outcome.assets.size() == 1 ? " asset" : " assets");
  const auto add = [&](State state, const char* words) {
    if (count(state) != 0) text += ", " + std::to_string(count(state)) + " " + words;
  };
  add(State::kStale, "to bake");
  add(State::kBaked, "baked");
  add(State::kCached, "from the cache");
  add(State::kFresh, "up to date");
  add(State::kFailed, "failed");
  return text;
}

void print_outcome(const ProjectOutcome& outcome, bool explain, bool dry_run, bool notes) {
  for (const AssetOutcome& asset : outcome.assets) {
    if (!explain || asset.reason.empty()) continue;
    std::fprintf(stderr, "%-7s %s%s%s: %s\n", state_name(asset.state), asset.name.c_str(),
                 asset.tier.empty() ? "" : " for ", asset.tier.c_str(), asset.reason.c_str());
  }
  print_findings(outcome.diagnostics, notes);
  for (const BundleOutcome& bundle : outcome.bundles) {
    const char* what = bundle.fresh     ? "up to date"
                       : bundle.written ? "written"
                       : dry_run        ? "to write"
                                        : "not written";
    const std::string size = bundle.bytes == 0 ? "" : human_bytes(bundle.bytes) + ", ";
    std::fprintf(stderr, "%s: %s%s\n", bundle.path.c_str(), size.c_str(), what);
    const auto file = bundle.written ? MappedFile::open(bundle.path) : Result<MappedFile>();
    if (!file) continue;
    if (const auto view = BundleView::open(file->bytes())) print_scenes(*view);
  }
  std::fprintf(stderr, "%s\n", counts_of(outcome).c_str());
  print_losses(outcome.diagnostics);
}

}  // namespace

void add_project_options(CommandLine& line, ProjectCommand& command) {
  line.group("Projects (without --model and --pattern)");
  line.flag("--watch", command.watch, "Rebuild whenever a file is saved, until Ctrl-C");
  line.group("Projects (without --model and --pattern)", Shown::kInFull);
  line.flag("--explain", command.explain, "Explain why each asset is rebuilt");
  line.option("--project", &command.file,
              "Project file to bake (default: modar.toml in the current folder)", {.type = "FILE"});
  line.flag("--dry-run", command.dry_run, "List what would be rebuilt, and build nothing",
            {.excludes = "--watch"});
  line.option("--cache", &command.cache,
              "Folder of assets that are already baked; several machines may share it",
              {.type = "DIR"});
  line.option("--cache-key", &command.cache_key,
              "Sign cache entries with this secret key, and ignore entries that it did not sign",
              {.type = "K"});
  line.flag("--outside", command.outside,
            "Allow files outside the project's folder, for a project that you trust");
  line.option("--asset", &command.asset,
              "Bake this model or pattern into the cache, and write no bundle", {.type = "NAME"});
  line.option("--depfile", &command.depfile, "Write what the bundles depend on, as make rules",
              {.type = "FILE"});
}

namespace {

/// The names of a folder's files. Folders in it do not count: a bake makes some.
std::string files_in(const std::string& folder) {
  std::set<std::string> names;
  std::error_code error;
  std::filesystem::directory_iterator it(folder, error);
  for (; !error && it != std::filesystem::directory_iterator(); it.increment(error)) {
    if (!it->is_directory(error)) names.insert(it->path().filename().string());
  }
  std::string text;
  for (const std::string& name : names) text += name + '\n';
  return text;
}

/// Sizes and times of files and names in folders, as text that changes when one of them does.
std::string states_of(const std::set<std::string>& paths) {
  std::string text;
  for (const std::string& path : paths) {
    struct stat status {};
    const bool there = ::stat(path.c_str(), &status) == 0;
    if (there && S_ISDIR(status.st_mode)) {
      text += path + '\n' + files_in(path);
      continue;
    }
    text += path + ' ' + std::to_string(there ? status.st_size : -1) + ' ' +
            std::to_string(status.st_mtim.tv_sec) + '.' + std::to_string(status.st_mtim.tv_nsec) +
            '\n';
  }
  return text;
}

/// What a bake of the project reads, and the folders where a glob may match more.
std::set<std::string> watched_paths(const std::string& file, const ProjectOutcome& outcome) {
  std::set<std::string> paths = {file};
  for (const std::string& input : outcome.inputs) {
    paths.insert(input);
    const std::string folder = std::filesystem::path(input).parent_path().string();
    paths.insert(folder.empty() ? "." : folder);
  }
  return paths;
}

Result<ProjectOutcome> bake_once(const ProjectCommand& command, const std::string& file,
                                 const CommonOptions& common) {
  MODAR_ASSIGN(const Project project, read_project(file, command.outside));
  if (!command.depfile.empty()) MODAR_TRY(keep_no_depfile(command.depfile));
  ProjectOptions options;
  options.cache = command.cache;
  options.cache_key = command.cache_key;
  warn_of_readers(command.cache_key);
  options.only = command.asset;
  options.jobs = common.jobs;
  options.dry_run = command.dry_run;
  options.tool_version = MODAR_VERSION;
  std::unique_ptr<MemoryLimit> limit;
  if (common.memory_bytes != 0) {
    const std::string out = project.path(project.out);
    MODAR_TRY(make_output_folder(out));
    MODAR_ASSIGN(auto started, MemoryLimit::start(out, common.memory_bytes));
    limit = std::move(started);
    options.memory_limited = true;
  }
  ProgressBar bar(common.quiet, common.progress_json);
  auto baked = bake_project(project, options,
                            [&](const std::string& stage, double done) { bar.show(stage, done); });
  bar.clear();
  MODAR_ASSIGN(ProjectOutcome outcome, std::move(baked));
  if (!command.depfile.empty() && !command.dry_run)
    MODAR_TRY(write_depfile(command.depfile, outcome));
  if (!common.quiet) {
    print_outcome(outcome, command.explain || command.dry_run, command.dry_run, common.notes);
  }
  if (common.json) std::fputs(project_json(outcome).dump().c_str(), stdout);
  for (const Error& error : outcome.errors) print_error(error);
  return outcome;
}

/// Bakes, and again once something that was read has changed and rested for a moment: until a
/// signal ends the process. What fails is printed, and waits for the next change.
void watch_project(const ProjectCommand& command, const std::string& file,
                   const CommonOptions& common) {
  constexpr std::chrono::milliseconds kLook(200);
  std::set<std::string> paths = {file};
  for (;;) {
    // Before the bake: files saved while it runs are changes.
    std::string before = states_of(paths);
    const auto outcome = bake_once(command, file, common);
    if (!outcome) print_error(outcome.error());
    if (outcome) {
      const std::set<std::string> now = watched_paths(file, *outcome);
      if (now != paths) before = states_of(now);
      paths = now;
    }
    if (!common.quiet) std::fprintf(stderr, "watching %zu files and folders\n", paths.size());
    while (states_of(paths) == before) std::this_thread::sleep_for(kLook);
    for (std::string last; last != states_of(paths);) {
      last = states_of(paths);
      std::this_thread::sleep_for(kLook);
    }
  }
}

}  // namespace

Result<ExitCode> run_project(const ProjectCommand& command, const CommonOptions& common,
                             const std::vector<std::string>& words) {
  MODAR_TRY(refuse_other_options(words));
  const std::string file = command.file.empty() ? kProjectFile : command.file;
  if (command.watch) watch_project(command, file, common);
  MODAR_ASSIGN(const ProjectOutcome outcome, bake_once(command, file, common));
  return outcome.errors.empty() ? ExitCode::kOk : outcome.errors.front().exit;
}

namespace {

struct InitCommand {
  std::string folder = ".";
  bool force = false;
  bool schema = false;
};

Result<ExitCode> run_init(const InitCommand& command) {
  if (command.schema) {
    std::fputs(project_schema().c_str(), stdout);
    return ExitCode::kOk;
  }
  const std::string path =
      (std::filesystem::path(command.folder) / kProjectFile).lexically_normal();
  std::error_code error;
  if (!std::filesystem::exists(command.folder, error)) {
    if (is_web_address(command.folder)) {
      return missing_file(command.folder, {ExitCode::kIo, "io.folder", command.folder, "", ""});
    }
    for (const char* folder : {"models", "patterns"}) {
      MODAR_TRY(make_output_folder((std::filesystem::path(command.folder) / folder).string()));
    }
    std::fprintf(stderr,
                 "%s: created, with folders for models and pattern pictures; fill them, then run "
                 "`modar init %s` again\n",
                 command.folder.c_str(), command.folder.c_str());
    return ExitCode::kOk;
  }
  if (!command.force && std::filesystem::exists(path, error)) {
    return fail(ExitCode::kUsage, "init.exists", path, "a project file already exists",
                "edit it, or replace it with --force");
  }
  MODAR_ASSIGN(const InitialProject initial, initial_project(command.folder));
  MODAR_TRY(write_file(path, std::string_view(initial.text)));
  for (const Diagnostic& one : initial.said) print_diagnostic(one);
  std::fprintf(stderr, "%s: written; review it, then run `modar bake` in its folder\n",
               path.c_str());
  return ExitCode::kOk;
}

/// The folder that --cache names, or that of the project in the current folder.
Result<std::string> cache_folder(const std::string& named) {
  if (!named.empty()) return named;
  std::error_code error;
  if (!std::filesystem::exists(kProjectFile, error)) return std::string(kCacheFolder);
  MODAR_ASSIGN(const Project project, read_project(kProjectFile));
  return project.cache.empty() ? std::string(kCacheFolder) : project.cache;
}

struct NinjaPlanCommand {
  std::string file = kProjectFile;
  std::string cache;
  std::string cache_key;
  std::string runner;
  bool outside = false;
  bool ninja = false;
};

/// A path in a build file of Ninja.
std::string ninja_quoted(const std::string& path) {
  std::string out;
  for (const char c : path) {
    if (c == ' ' || c == ':' || c == '$') out += '$';
    out += c;
  }
  return out;
}

/// Text in a build file of Ninja, as the value of a variable.
std::string ninja_value(const std::string& text) {
  std::string out;
  for (const char c : text) out += c == '$' ? "$$" : std::string(1, c);
  return out;
}

/// ssh starts in another folder, and its words go through a second shell.
bool runs_by_ssh(const std::string& runner) {
  const std::string program = runner.substr(0, runner.find(' '));
  return program.substr(program.rfind('/') + 1) == "ssh";
}

/// The edge by which Ninja writes the plan again, under the name build.ninja, when a file is added
/// to a folder that a glob looks into or taken out of it, or modar.toml changes.
std::string ninja_generator(const NinjaPlanCommand& command, const Project& project,
                            const std::string& program) {
  std::string words = "modar plan --ninja --project " + shell_quoted(command.file) + " --cache " +
                      shell_quoted(command.cache);
  if (command.outside) words += " --outside";
  if (!command.cache_key.empty()) words += " --cache-key " + shell_quoted(command.cache_key);
  if (!command.runner.empty()) words += " --run " + shell_quoted(command.runner);
  std::string text = "rule plan\n  command = " + ninja_value(words) +
                     " > $out.new && mv $out.new $out\n  generator = 1\n"
                     "  description = look for assets again\n"
                     "build build.ninja: plan " +
                     ninja_quoted(command.file) + program;
  for (const std::string& folder : project.folders) text += " " + ninja_quoted(folder);
  return text + "\n\n";
}

/// An edge for each asset, which bakes it into the cache, and one for all bundles. Stamps represent
/// entries of the cache, whose names nobody knows before the bake.
std::string ninja_plan(const NinjaPlanCommand& command, const Project& project,
                       const ProjectOutcome& planned) {
  const std::string runner = command.runner.empty() ? "" : command.runner + " ";
  const bool ssh = runs_by_ssh(command.runner);
  const auto word = [ssh](const std::string& text) {
    return ninja_value(ssh ? shell_quoted(shell_quoted(text)) : shell_quoted(text));
  };
  const auto path = [ssh](const std::string& name) {
    std::error_code error;
    return ssh ? std::filesystem::absolute(name, error).lexically_normal().string() : name;
  };
  const std::string outside = command.outside ? " --outside" : "";
  const bool keyed = !command.cache_key.empty();
  std::string text =
      "# modar plan --ninja: save it as build.ninja, and run `ninja` after each "
      "change.\n"
      "ninja_required_version = 1.5\n"
      "rule asset\n  command = " +
      runner + "modar bake --quiet" + outside + " --project " + word(path(command.file)) +
      " --cache " + word(path(command.cache)) +
      (keyed ? " --cache-key " + word(path(command.cache_key)) : std::string()) +
      " --jobs 1 --asset $name --depfile $told && touch $out\n" +
      "  depfile = $out.d\n  deps = gcc\n  description = bake $name\n"
      "rule bundles\n  command = modar bake --quiet" +
      outside + " --project " +
      ninja_value(shell_quoted(command.file) + " --cache " + shell_quoted(command.cache) +
                  (keyed ? " --cache-key " + shell_quoted(command.cache_key) : std::string())) +
      "\n  restat = 1\n  description = link the bundles\n\n";
  const std::string program = " | " + ninja_quoted(program_folder() + "/modar");
  text += ninja_generator(command, project, program);
  std::string stamps;
  std::set<std::string> names;
  for (const AssetOutcome& asset : planned.assets) {
    if (!names.insert(asset.name).second) continue;
    std::string file = asset.name;
    std::replace(file.begin(), file.end(), '/', '_');
    const std::string stamp = project.path(".modar/plan/" + file);
    text += "build " + ninja_quoted(stamp) + ": asset " + ninja_quoted(command.file) + program +
            "\n  name = " + word(asset.name) + "\n  told = " + word(path(stamp + ".d")) + "\n";
    stamps += " " + ninja_quoted(stamp);
  }
  std::string bundles;
  for (const BundleOutcome& bundle : planned.bundles) bundles += " " + ninja_quoted(bundle.path);
  std::set<std::string> lights;  // and what nodes have
  for (const ProjectScene& scene : project.scenes) {
    if (!scene.request.light.empty()) lights.insert(project.path(scene.request.light));
    for (const NodeRequest& node : scene.nodes) add_files(project.located(node), lights);
  }
  text += "build" + bundles + ": bundles" + stamps + " | build.ninja";
  for (const std::string& light : lights) text += " " + ninja_quoted(light);
  return text + "\ndefault" + bundles + "\n";
}

Result<ExitCode> write_ninja_plan(NinjaPlanCommand& command) {
  MODAR_ASSIGN(const Project project, read_project(command.file, command.outside));
  if (command.cache.empty()) {
    command.cache = project.path(project.cache.empty() ? kCacheFolder : project.cache);
  }
  ProjectOptions options;
  options.cache = command.cache;
  options.cache_key = command.cache_key;
  options.dry_run = true;
  options.tool_version = MODAR_VERSION;
  MODAR_ASSIGN(const ProjectOutcome planned, bake_project(project, options, {}));
  MODAR_TRY(make_output_folder(project.path(".modar/plan")));
  std::fputs(ninja_plan(command, project, planned).c_str(), stdout);
  return ExitCode::kOk;
}

constexpr std::uint64_t kNoSize = ~std::uint64_t{0};

struct CacheCommand {
  std::string folder;
  std::string key;                ///< of `verify`: the file of the cache's key; empty: none
  std::uint64_t bytes = kNoSize;  ///< of `prune`: how much stays
  bool json = false;
};

void print_summary(const CacheCommand& command, const CacheSummary& summary, const char* verb) {
  if (command.json) {
    const Json json = {{"entries", summary.entries},
                       {"bytes", summary.bytes},
                       {"damaged", Json::list(summary.damaged)}};
    std::fputs(json.dump().c_str(), stdout);
    return;
  }
  for (const std::string& path : summary.damaged)
    std::printf("%s: damaged, removed\n", path.c_str());
  std::printf("%s%llu entries, %s\n", verb, static_cast<unsigned long long>(summary.entries),
              human_bytes(summary.bytes).c_str());
}

/// Without a size, says what sizes would remove.
Result<ExitCode> run_prune(const CacheCommand& command) {
  MODAR_ASSIGN(const std::string folder, cache_folder(command.folder));
  if (command.bytes != kNoSize) {
    MODAR_ASSIGN(const CacheSummary removed, prune_cache(folder, command.bytes));
    print_summary(command, removed, "removed: ");
    return ExitCode::kOk;
  }
  MODAR_ASSIGN(const CacheSummary all, summarise_cache(folder));
  print_summary(command, all, "nothing removed of ");
  if (command.json || all.entries == 0) return ExitCode::kOk;
  std::printf("--size keeps the most recently used entries:\n");
  for (const std::uint64_t bytes : {all.bytes / 2, all.bytes / 10, std::uint64_t{0}}) {
    MODAR_ASSIGN(const CacheSummary removed, prune_cache(folder, bytes, true));
    std::printf(
        "  --size %-12llu would remove %llu entries, %s\n", static_cast<unsigned long long>(bytes),
        static_cast<unsigned long long>(removed.entries), human_bytes(removed.bytes).c_str());
  }
  return ExitCode::kOk;
}

void add_cache_options(CommandLine& line, CacheCommand& command) {
  line.option("--cache", &command.folder,
              "Cache folder (default: that of the project in the current folder)", {.type = "DIR"});
  line.flag("--json", command.json, "Print the counts as JSON");
}

}  // namespace

void add_init(CommandLine& program) {
  CommandLine& line = program.command(
      "init", "Write a project file, modar.toml, for a folder of models and pictures");
  const auto command = std::make_shared<InitCommand>();
  line.option("folder", &command->folder, "Folder to search, with its subfolders",
              {.shows_default = true});
  line.flag("--force", command->force, "Replace an existing modar.toml");
  line.flag("--schema", command->schema, "Print the JSON schema of modar.toml, and write nothing");
  line.footer(example("  modar init museum && cd museum && modar bake\n"));
  line.run([command] { return run_init(*command); });
}

void add_plan(CommandLine& program) {
  CommandLine& line =
      program.command("plan", "Write a build file that bakes each asset of a project on its own");
  const auto command = std::make_shared<NinjaPlanCommand>();
  line.flag("--ninja", command->ninja,
            "Write it for Ninja, to stdout: one edge per asset, and one for the bundles",
            {.required = true});
  line.option("--project", &command->file, "Project file", {.type = "FILE", .shows_default = true});
  line.option("--cache", &command->cache,
              "Cache of baked assets; every machine sees it under this path", {.type = "DIR"});
  line.option("--cache-key", &command->cache_key,
              "Sign cache entries with this secret key, and ignore all others", {.type = "K"});
  line.flag("--outside", command->outside, "Allow files outside the project's folder");
  line.option("--run", &command->runner, "Prefix of each asset's command: srun -Q -n1, or ssh HOST",
              {.type = "WORDS"});
  line.footer(
      example("  modar plan --ninja --run 'srun -Q -n1' --cache /srv/modar-cache > build.ninja && "
              "ninja\n"));
  line.run([command] { return write_ninja_plan(*command); });
}

void add_cache(CommandLine& program) {
  CommandLine& cache = program.command("cache", "Show, prune or verify a cache of baked assets");
  const auto command = std::make_shared<CacheCommand>();
  CommandLine& show = cache.command("show", "Show the number of entries and their size");
  add_cache_options(show, *command);
  show.run([command]() -> Result<ExitCode> {
    MODAR_ASSIGN(const std::string folder, cache_folder(command->folder));
    MODAR_ASSIGN(const CacheSummary summary, summarise_cache(folder));
    print_summary(*command, summary, "");
    return ExitCode::kOk;
  });
  CommandLine& prune = cache.command("prune", "Remove the least recently used entries");
  add_cache_options(prune, *command);
  prune.size("--size", command->bytes,
             "Keep at most this much (1G, 800M); without it, only report what would be removed",
             {.type = "SIZE"});
  prune.run([command] { return run_prune(*command); });
  CommandLine& verify = cache.command("verify", "Read every entry and remove damaged ones");
  add_cache_options(verify, *command);
  verify.option("--cache-key", &command->key, "Also remove entries that this key did not sign",
                {.type = "K"});
  verify.footer(example("  modar cache verify --cache /srv/modar-cache\n"));
  verify.run([command]() -> Result<ExitCode> {
    MODAR_ASSIGN(const std::string folder, cache_folder(command->folder));
    MODAR_ASSIGN(const CacheSummary summary, verify_cache(folder, command->key));
    print_summary(*command, summary, "");
    return summary.damaged.empty() ? ExitCode::kOk : ExitCode::kInvalidInput;
  });
}

}  // namespace modar
