// Views of models all around, for thumbs that turn.
#include <algorithm>
#include <cstdlib>
#include <optional>

#include "bake/extensions/report/model_pictures.hpp"
#include "bake/extensions/studio/exports.hpp"
#include "bake/extensions/studio/report_view.hpp"
#include "bake/extensions/studio/session.hpp"
#include "formats/base/ranges.hpp"
#include "formats/bundle_view.hpp"
#include "modar/mapped_file.hpp"

namespace modar {
namespace {

// Quality of JPEG. Higher is sharper and larger.
constexpr int kQuality = 85;

struct AllAround {
  std::uint32_t side = 160;  ///< pixels
  std::uint32_t views = 8;
};

std::uint32_t number_in(const Call& call, const char* name, long least, long most) {
  return static_cast<std::uint32_t>(
      std::clamp(std::strtol(call.asked(name).c_str(), nullptr, 10), least, most));
}

/// Side by side, from left to right.
RgbaImage strip_of(ModelCamera& camera, std::uint32_t model, const AllAround& turn) {
  RgbaImage strip{turn.side * turn.views, turn.side, {}};
  strip.pixels.resize(std::size_t{4} * strip.width * strip.height);
  for (std::uint32_t view = 0; view < turn.views; ++view) {
    const RgbaImage one = camera.turned(model, 360.0 * view / turn.views);
    for (std::uint32_t y = 0; y < turn.side; ++y) {
      const auto* row = one.pixels.data() + std::size_t{4} * y * turn.side;
      std::copy(
          row, row + std::size_t{4} * turn.side,
          strip.pixels.data() + std::size_t{4} * (std::size_t{y} * strip.width + view * turn.side));
    }
  }
  return strip;
}

std::optional<std::uint32_t> model_named(const BundleView& bundle, const std::string& name) {
  for (std::uint32_t m = 0; m < bundle.models().size(); ++m) {
    if (bundle.name(bundle.models()[m].name) == name) return m;
  }
  return std::nullopt;
}

/// The strip of one model; those of all others are drawn and kept along, for setting up the
/// device's renderer takes longer than drawing.
Result<std::string> strip(Session& session, const std::string& name, const AllAround& turn) {
  MODAR_ASSIGN(const std::string path, baked_bundle(session));
  MODAR_ASSIGN(const MappedFile file, MappedFile::open(path_in(session, path)));
  MODAR_ASSIGN(const BundleView bundle, BundleView::open(file.bytes()));
  const auto key_of = [&](std::uint32_t model) {
    return std::to_string(turn.side) + "x" + std::to_string(turn.views) + "|" +
           std::to_string(bundle.header().hash) + "|" + std::to_string(model);
  };
  const auto index = model_named(bundle, name);
  if (!index) {
    return fail(ExitCode::kUsage, "studio.unknown", name, "the model has not been baked yet",
                "bake");
  }
  const std::lock_guard lock(session.drawing);
  if (const auto known = session.pictures.thumbs.find(key_of(*index))) return *known;
  const auto side = static_cast<int>(turn.side);
  MODAR_ASSIGN(const auto camera, ModelCamera::create(bundle, side, side));
  std::string found;
  for (std::uint32_t m = 0; m < bundle.models().size(); ++m) {
    MODAR_ASSIGN(const auto jpeg, encode_jpeg(strip_of(*camera, m, turn), kQuality));
    std::string bytes(reinterpret_cast<const char*>(jpeg.data()), jpeg.size());
    if (m == *index) found = bytes;
    session.pictures.thumbs.add(key_of(m), std::move(bytes), jpeg.size());
  }
  return found;
}

}  // namespace

Result<Answer> get_turntable(Session& session, const Call& call) {
  const std::string file = call.path.substr(std::string_view("api/thumb/").size());
  MODAR_ASSIGN(const ProjectText::State state, session.text.read());
  const ProjectDraft draft = read_draft(state.text, session.file);
  const auto& models = draft.project.models;
  const auto model = ranges::find(models, file, &ProjectAsset::file);
  if (model == models.end()) return answer_of(unknown_verb(call));
  const AllAround turn{number_in(call, "size", 32, 320), number_in(call, "turn", 1, 16)};
  MODAR_ASSIGN(std::string drawn, strip(session, model->name, turn));
  return jpeg_answer(std::move(drawn));
}

}  // namespace modar
