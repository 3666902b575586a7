// `modar bake`: OBJ models and pattern images to one bundle.
#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>
#include <system_error>

#include "bake/bundle/bundle_builder.hpp"
#include "bake/bundle/topology_json.hpp"
#include "bake/check/reproduce.hpp"
#include "bake/commands/commands.hpp"
#include "bake/commands/json_output.hpp"
#include "bake/memory/memory_limit.hpp"
#include "bake/output_folder.hpp"
#include "bake/terminal.hpp"
#include "formats/bundle_view.hpp"
#include "modar/mapped_file.hpp"

namespace modar {
namespace {

void print_summary(const BundleView& bundle, const Report& report, const std::string& path) {
  for (std::uint32_t m = 0; m < bundle.models().size(); ++m) {
    const ModelRecord& model = bundle.models()[m];
    std::fprintf(stderr,
                 "model   %-16s %llu triangles, %llu vertices, %u chunks, error at most %.3g of a "
                 "diagonal of %.4g\n",
                 std::string(bundle.name(model.name)).c_str(),
                 static_cast<unsigned long long>(model.triangle_count),
                 static_cast<unsigned long long>(model.vertex_count), model.chunk_count,
                 model.position_error_max, model.diagonal);
    if (const auto topology = stated_topology(bundle, m)) {
      std::fprintf(stderr, "        %s\n", topology_words(*topology).c_str());
    }
    if (const auto levels = stated_levels(bundle, m)) {
      std::fprintf(stderr, "        %s\n", level_words(*levels).c_str());
    }
  }
  for (std::uint32_t t = 0; t < bundle.textures().size(); ++t) {
    const TextureRecord& texture = bundle.textures()[t];
    std::fprintf(stderr, "texture %-16s %u x %u, %u levels, %.2f dB\n",
                 std::string(bundle.name(texture.name)).c_str(), texture.width, texture.height,
                 texture.level_count, static_cast<double>(texture.psnr_db));
  }
  for (std::uint32_t p = 0; p < bundle.patterns().size(); ++p) {
    const PatternRecord& pattern = bundle.patterns()[p];
    std::string counts;
    for (std::uint32_t s = 0; s < bundle.parameter_sets().size(); ++s) {
      const ParameterSetRecord& set = bundle.parameter_sets()[s];
      counts += " " + std::string(bundle.name(set.name)) + "=" +
                std::to_string(bundle.features(p, set.id).keypoints.size());
    }
    std::fprintf(stderr, "pattern %-16s %u x %u%s%s\n",
                 std::string(bundle.name(pattern.name)).c_str(), pattern.width, pattern.height,
                 counts.empty() ? "" : ", keypoints", counts.c_str());
  }
  double ms = 0;
  for (const StageReport& stage : report.stages) ms += stage.ms;
  std::fprintf(stderr, "%s: %s, baked in %.1f s\n", path.c_str(),
               human_bytes(bundle.bytes().size()).c_str(), ms / 1000);
}

/// Says so where the limit was passed.
void report_memory(const BakeRequest& request, Report& report) {
  const std::uint64_t peak = process_cost().peak_rss_bytes;
  if (request.memory_bytes == 0 || peak <= request.memory_bytes) return;
  report.findings.push_back({"bake.memory", DiagnosticSeverity::kWarning, "--memory", 0,
                             "the bake took " + human_bytes(peak) + ", more than was asked",
                             "fewer --jobs, smaller textures or several bundles take less"});
}

}  // namespace

int run_bake(const BakeCommand& command) {
  if (const std::string& folder = command.request.textures.picture_folder; !folder.empty()) {
    if (auto made = make_output_folder(folder); !made) return print_error(made.error());
  }
  std::unique_ptr<MemoryLimit> limit;
  if (command.request.memory_bytes != 0) {
    const auto folder = std::filesystem::absolute(command.output).parent_path();
    auto started = MemoryLimit::start(folder.string(), command.request.memory_bytes);
    if (!started) return print_error(started.error());
    limit = std::move(*started);
  }
  ProgressBar bar(command.quiet);
  Report report;
  report.progress = [&](const std::string& stage, double done) { bar.show(stage, done); };

  Result<BundleContent> content = build_bundle(command.request, report);
  bar.clear();
  report_memory(command.request, report);
  if (!command.quiet) {
    for (const Diagnostic& finding : report.findings) print_diagnostic(finding);
  }
  if (!content) return print_error(content.error());
  StageTimer writing(report, "write");
  if (auto saved = save_bundle(*content, command.output); !saved) return print_error(saved.error());

  // What is told of the bundle is read back from the file, so that it is true of the file.
  Result<MappedFile> file = MappedFile::open(command.output);
  if (!file) return print_error(file.error());
  Result<BundleView> bundle = BundleView::open(file->bytes());
  if (!bundle) return print_error(bundle.error());
  if (command.prove_reproducible) {
    bar.show("bake again", 0);
    auto proven = prove_reproducible(command.request, command.words, file->bytes());
    bar.clear();
    if (!proven) return print_error(proven.error());
    if (!command.quiet) std::fprintf(stderr, "a second bake elsewhere gave the same bytes\n");
  }
  writing.done(content->models.size() + content->patterns.size(), file->bytes().size());
  bar.clear();
  if (!command.quiet) print_summary(*bundle, report, command.output);
  if (command.json) std::fputs(bake_json(*bundle, report, process_cost()).c_str(), stdout);
  return static_cast<int>(ExitCode::kOk);
}

}  // namespace modar
