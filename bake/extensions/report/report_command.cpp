// `modar report`: a bundle as one HTML file.
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <thread>

#include "bake/commands/commands.hpp"
#include "bake/extensions/report/report_page.hpp"
#include "bake/io/input.hpp"
#include "bake/io/output.hpp"
#include "bake/io/terminal.hpp"
#include "formats/base/atomic_file.hpp"
#include "modar/mapped_file.hpp"

namespace modar {
namespace {

struct ReportCommand {
  std::string bundle;
  std::string output;
  std::string bake_file;  ///< empty: none
  ReportOptions options;
  bool quiet = false;
};

Result<ExitCode> run_report(ReportCommand& command) {
  MODAR_TRY(keep_inputs(command.output, {command.bundle, command.bake_file}));
  const std::string ending = std::filesystem::path(command.output).extension().string();
  if (!ending.empty() && ending != ".html" && ending != ".htm") {
    return fail(ExitCode::kUsage, "out.format", command.output, "the report is a page in HTML",
                "name it FILE.html");
  }
  MODAR_TRY(keep_other_kinds(command.output, "page of modar report", [](std::string_view start) {
    return start.find("content=\"modar report\"") != std::string_view::npos;
  }));
  MODAR_TRY(try_output(command.output, 0));
  MODAR_ASSIGN(const MappedFile file, MappedFile::open(command.bundle));
  MODAR_TRY(require_kind(FileKind::kBundle, command.bundle));
  const Result<BundleView> bundle = BundleView::open(file.bytes());
  if (!bundle) return file.settle(Result<ExitCode>(in_file(command.bundle, bundle.error())));
  command.options.title = std::filesystem::path(command.bundle).filename().string();
  if (!command.bake_file.empty()) {
    MODAR_ASSIGN(const MappedFile json, MappedFile::open(command.bake_file));
    const auto bytes = json.bytes();
    command.options.bake_json.assign(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  }
  command.options.tool_version = MODAR_VERSION;
  ProgressBar bar(command.quiet);
  auto page = report_page(*bundle, command.options,
                          [&](const std::string& stage, double done) { bar.show(stage, done); });
  bar.clear();
  MODAR_ASSIGN(const std::string text, file.settle(std::move(page)));
  MODAR_TRY(write_file(command.output, std::string_view(text)));
  if (!command.quiet) {
    std::fprintf(stderr, "%s: %s\n", command.output.c_str(), human_bytes(text.size()).c_str());
  }
  return ExitCode::kOk;
}

}  // namespace

void add_report(CommandLine& program) {
  CommandLine& line =
      program.command("report", "Show a bundle as one HTML page: pictures, sizes, errors, verdict");
  const auto command = std::make_shared<ReportCommand>();
  command->options.jobs = std::max(1u, std::thread::hardware_concurrency());
  line.option("bundle", &command->bundle, "Bundle to read",
              {.type = "BUNDLE.modar", .required = true});
  line.option("-o,--output", &command->output, "Page to write",
              {.type = "FILE.html", .required = true});
  line.flag("--range", command->options.range,
            "Also simulate each pattern's working range (seconds per pattern)");
  line.option("--bake", &command->bake_file,
              "Output of `modar bake --json`: adds each stage's time, and what became of the "
              "files' content",
              {.type = "FILE.json"});
  line.option(
      "--texture-pictures", &command->options.texture_pictures,
      "Folder of `modar bake --texture-pictures`: adds each texture's source and difference",
      {.type = "DIR"});
  line.option("--jobs", &command->options.jobs, "Threads",
              {.shows_default = true, .least = 1, .most = 256});
  line.flag("--quiet", command->quiet, "No progress or summary on stderr");
  line.footer(example("  modar report museum.modar -o museum.html\n"));
  line.run([command] { return run_report(*command); });
}

}  // namespace modar
