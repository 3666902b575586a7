// libFuzzer target: any text as a modar.toml gives a project that stays in its folder, or a coded
// error.
#include <cstddef>
#include <cstdint>

#include "bake/project/project.hpp"
#include "tests/fuzz/input_file.hpp"
#include "tests/fuzz/need.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using modar::test::need;
  static modar::test::InputFile file("modar.toml");
  const auto project = modar::read_project(file.write(data, size));
  if (!project) {
    modar::test::need_told(project.error());
    return 0;
  }
  need(!project->bundles.empty() && !project->tiers.empty());
  for (const auto* assets : {&project->models, &project->patterns}) {
    for (const modar::ProjectAsset& asset : *assets) {
      need(!asset.name.empty() && project->may_use(project->path(asset.file)));
      need(asset.width_mm >= 0);
    }
  }
  need(project->out.find("..") == std::string::npos ||
       project->may_use(project->path(project->out)));
  return 0;
}
