// libFuzzer target: any text as a modar.toml gives a project that stays in its folder, or a coded
// error; an edit of one that is right leaves TOML, and a draft is read of any.
#include <cstddef>
#include <cstdint>
#include <string>

#include "bake/project/project.hpp"
#include "bake/project/project_edit.hpp"
#include "tests/fuzz/input_file.hpp"
#include "tests/fuzz/need.hpp"

namespace {

/// Edits find their bytes without toml++: what they make, it reads.
void need_toml(const modar::Result<std::string>& edited) {
  if (!edited) return;
  const auto read = modar::read_project_text(*edited, "modar.toml");
  modar::test::need(read || read.error().code != "project.toml");
}

void edit(const std::string& text) {
  need_toml(modar::set_key(text, {"project", {}}, "name", "vases"));
  need_toml(modar::remove_key(text, {"project", {}}, "name"));
  need_toml(modar::add_table(text, "model", {{"file", "vase.obj"}}));
  for (const char* table : {"model", "pattern", "scene"}) {
    const std::size_t count = modar::count_tables(text, table);
    if (count == 0) continue;
    need_toml(modar::set_key(text, {table, count - 1}, "text.en", "\"A\" \n vase"));
    need_toml(modar::remove_table(text, {table, 0}));
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using modar::test::need;
  static modar::test::InputFile file("modar.toml");
  const std::string text(reinterpret_cast<const char*>(data), size);
  static_cast<void>(modar::read_draft(text, "modar.toml"));
  const auto project = modar::read_project(file.write(data, size));
  if (!project) {
    modar::test::need_told(project.error());
    return 0;
  }
  edit(text);
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
