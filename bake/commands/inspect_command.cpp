// `modar inspect`: what a bundle holds, as a table, as JSON, or taken out as files.
#include <cstdio>
#include <memory>
#include <string>

#include "bake/bundle/bundle_json.hpp"
#include "bake/commands/commands.hpp"
#include "bake/export/extract.hpp"
#include "bake/io/input.hpp"
#include "bake/io/terminal.hpp"
#include "formats/bundle_view.hpp"
#include "modar/mapped_file.hpp"

namespace modar {
namespace {

struct InspectCommand {
  std::string bundle;
  std::string extract;  ///< folder for GLB, PKM, YML; empty: none
  bool force = false;
  bool json = false;
};

void print_models(const BundleView& bundle) {
  if (bundle.models().empty()) return;
  std::printf("\n%-18s %11s %11s %7s %10s %14s %10s\n", "model", "triangles", "vertices", "chunks",
              "diagonal", "max error", "of diag.");
  for (std::uint32_t m = 0; m < bundle.models().size(); ++m) {
    const ModelRecord& model = bundle.models()[m];
    std::printf("%-18s %11llu %11llu %7u %10.5g %14.3g %10.2g\n",
                std::string(bundle.name(model.name)).c_str(),
                static_cast<unsigned long long>(model.triangle_count),
                static_cast<unsigned long long>(model.vertex_count), model.chunk_count,
                model.diagonal, model.position_error_max,
                model.diagonal > 0 ? model.position_error_max / model.diagonal : 0.0);
    if (const auto topology = stated_topology(bundle, m)) {
      std::printf("  %s\n", topology_words(*topology).c_str());
    }
    if (const auto repair = stated_repair(bundle, m)) {
      std::printf("  %s\n", repair_words(*repair).c_str());
    }
    if (const std::string levels = level_words(bundle, m); !levels.empty()) {
      std::printf("  %s\n", levels.c_str());
    }
    for (const ClipRecord& clip : bundle.clips()) {
      if (clip.model != m) continue;
      std::printf("  clip %s: %.3g s, error %.2g\n", std::string(bundle.name(clip.name)).c_str(),
                  static_cast<double>(clip.seconds), static_cast<double>(clip.error) * model.scale);
    }
  }
}

void print_textures(const BundleView& bundle) {
  if (bundle.textures().empty()) return;
  std::printf("\n%-24s %11s %7s %10s %8s %7s %6s\n", "texture", "size", "levels", "bytes",
              "PSNR dB", "SSIM", "alpha");
  for (std::uint32_t t = 0; t < bundle.textures().size(); ++t) {
    const TextureRecord& texture = bundle.textures()[t];
    const std::string size = with_numbers("{}x{}", {texture.width, texture.height});
    std::printf("%-24s %11s %7u %10s %8.2f %7.4f %6s\n",
                std::string(bundle.name(texture.name)).c_str(), size.c_str(), texture.level_count,
                human_bytes(bundle.texture_data(t).size()).c_str(),
                static_cast<double>(texture.psnr_db), static_cast<double>(texture.ssim),
                (texture.flags & kTextureAlpha) != 0 ? "yes" : "no");
  }
}

void print_patterns(const BundleView& bundle) {
  if (bundle.patterns().empty()) return;
  std::printf("\n%-18s %11s %9s %6s", "pattern", "size", "width", "copies");
  for (const ParameterSetRecord& set : bundle.parameter_sets()) {
    std::printf(" %9s", std::string(bundle.name(set.name)).c_str());
  }
  std::printf("\n");
  for (std::uint32_t p = 0; p < bundle.patterns().size(); ++p) {
    const PatternRecord& pattern = bundle.patterns()[p];
    const std::string size = with_numbers("{}x{}", {pattern.width, pattern.height});
    char width[32] = "-";
    if (pattern.width_mm > 0) std::snprintf(width, sizeof width, "%.4g mm", pattern.width_mm);
    std::printf("%-18s %11s %9s %6u", std::string(bundle.name(pattern.name)).c_str(), size.c_str(),
                width, std::max(1u, pattern.copies));
    for (const ParameterSetRecord& each : bundle.parameter_sets()) {
      std::printf(" %9zu", bundle.features(p, each.id).keypoints.size());
    }
    std::printf("\n");
  }
}

void print_table(const BundleView& bundle, const std::string& path) {
  std::printf("%s: bundle %u.%u, %s, %zu sections\n", path.c_str(), bundle.header().major,
              bundle.header().minor, human_bytes(bundle.bytes().size()).c_str(),
              bundle.sections().size());
  print_models(bundle);
  print_textures(bundle);
  print_patterns(bundle);
  if (bundle.scenes().empty()) return;
  std::printf("\nscenes\n");
  for (std::uint32_t s = 0; s < bundle.scenes().size(); ++s) {
    const SceneRecord& scene = bundle.scenes()[s];
    std::printf("  on %s stands %s, %s\n",
                std::string(bundle.name(bundle.patterns()[scene.pattern].name)).c_str(),
                std::string(bundle.name(bundle.models()[scene.model].name)).c_str(),
                scene_words(bundle, s).c_str());
  }
}

Result<ExitCode> run_inspect(const InspectCommand& command) {
  MODAR_ASSIGN(const MappedFile file, MappedFile::open(command.bundle));
  MODAR_TRY(require_kind(FileKind::kBundle, command.bundle));
  Result<BundleView> bundle = BundleView::open(file.bytes());
  if (!bundle) return file.settle(Result<ExitCode>(in_file(command.bundle, bundle.error())));
  if (!command.extract.empty()) {
    MODAR_ASSIGN(const auto files,
                 file.settle(extract_bundle(*bundle, command.extract, command.force)));
    for (const std::string& name : files) std::fprintf(stderr, "wrote %s\n", name.c_str());
  }
  if (command.json) {
    std::fputs(bundle_json(*bundle).dump().c_str(), stdout);
  } else {
    print_table(*bundle, command.bundle);
  }
  return file.settle(Result<ExitCode>(ExitCode::kOk));
}

}  // namespace

void add_inspect(CommandLine& program) {
  CommandLine& line = program.command("inspect", "Show or extract what a bundle contains");
  const auto command = std::make_shared<InspectCommand>();
  line.option("bundle", &command->bundle, "Bundle to read", {.type = "BUNDLE", .required = true});
  line.option("--extract", &command->extract,
              "Write models as GLB, textures as PKM and KTX, patterns as YML", {.type = "DIR"});
  line.flag("--force", command->force, "Extract into a folder that contains other files");
  line.flag("--json", command->json, "Print as JSON");
  line.footer(example("  modar inspect spider.modar --extract out/\n"));
  line.run([command] { return run_inspect(*command); });
}

}  // namespace modar
