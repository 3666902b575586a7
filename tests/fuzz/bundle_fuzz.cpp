// libFuzzer target: any bytes as a bundle. Hashes are made true first, so that mutations reach the
// rules behind them; every fourth input keeps its own.
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <span>
#include <vector>

#include "formats/action_machine.hpp"
#include "formats/bundle_view.hpp"
#include "formats/check.hpp"
#include "formats/colour_grid.hpp"
#include "formats/draw_order.hpp"
#include "formats/trim.hpp"
#include "runtime/render/light_estimate.hpp"

#define XXH_INLINE_ALL
#include <xxhash.h>

namespace {

using namespace modar;

void rehash(std::vector<std::byte>& bytes) {
  if (bytes.size() < sizeof(FileHeader)) return;
  FileHeader header;
  std::memcpy(&header, bytes.data(), sizeof(header));
  header.file_size = bytes.size();
  const std::size_t room = (bytes.size() - sizeof(header)) / sizeof(SectionEntry);
  if (header.section_count > room) header.section_count = static_cast<std::uint32_t>(room % 32);
  XXH64_state_t state;
  XXH64_reset(&state, 0);
  XXH64_update(&state, &header, offsetof(FileHeader, hash));
  for (std::size_t i = 0; i < header.section_count; ++i) {
    std::byte* place = bytes.data() + sizeof(header) + i * sizeof(SectionEntry);
    SectionEntry entry;
    std::memcpy(&entry, place, sizeof(entry));
    if (entry.offset <= bytes.size() && entry.size <= bytes.size() - entry.offset) {
      entry.hash = XXH64(bytes.data() + entry.offset, static_cast<std::size_t>(entry.size), 0);
      std::memcpy(place, &entry, sizeof(entry));
    }
    XXH64_update(&state, &entry, sizeof(entry));
  }
  header.hash = XXH64_digest(&state);
  std::memcpy(bytes.data(), &header, sizeof(header));
}

/// Touches both ends of a span, so that the sanitizer sees one that leaves the bytes.
template <class T>
unsigned touch(std::span<const T> values) {
  const auto bytes = std::as_bytes(values);
  if (bytes.empty()) return 0;
  return static_cast<unsigned>(bytes.front()) + static_cast<unsigned>(bytes.back());
}

unsigned touch(std::string_view text) {
  return touch(std::span(text));
}

/// Walks over a chunk's draw order as the renderer does: each triangle once.
unsigned walk_order(const BundleView& view, std::uint32_t chunk) {
  const auto bytes = view.section(SectionType::kDrawOrder, chunk);
  if (bytes.empty()) return 0;
  const LevelRecord& level = view.levels()[view.chunks()[chunk].first_level];
  const auto indices = view.indices().subspan(level.index_offset, level.index_count * 2);
  const auto* first = reinterpret_cast<const DrawOrderRecord*>(bytes.data());
  std::vector<DrawOrderRange> waiting;
  std::size_t count = 0;
  unsigned sum = 0;
  walk_draw_order({first, bytes.size() / sizeof *first}, {0.5f, -2.0f, 1.0f}, waiting,
                  [&](std::uint32_t triangle) {
                    sum += touch(indices.subspan(std::size_t{triangle} * 6, 6));
                    ++count;
                  });
  if (3 * count != level.index_count) std::abort();
  return sum;
}

/// Looks for the light of a frame that shows the whole pattern.
unsigned look(const BundleView& view, std::uint32_t pattern) {
  const auto colours = view.section(SectionType::kPatternColours, pattern);
  if (colours.empty()) return 0;
  std::vector<std::uint8_t> pixels(3 * 16 * 16);
  for (std::size_t i = 0; i < pixels.size(); ++i)
    pixels[i] = static_cast<std::uint8_t>(60 + i % 90);
  CameraPicture frame;
  frame.width = frame.height = 16;
  frame.planes[0] = pixels.data();
  frame.strides[0] = 3 * 16;
  const PlaneLight light =
      look_at_pattern(frame, glm::mat4(1.0f), view.patterns()[pattern], colours);
  for (int c = 0; c < 3; ++c) {
    // Also true for NaN.
    if (light.known && !(light.middle[c] > 0.0f && light.middle[c] < 1e6f)) std::abort();
  }
  return touch(colours) + (light.known ? 1u : 0u);
}

/// Shows every pattern and taps every node, twice.
unsigned act(const BundleView& view) {
  ActionMachine machine(view);
  std::vector<SceneEvent> events;
  for (std::uint32_t p = 0; p < view.patterns().size(); ++p) {
    events.push_back({SceneEvent::Kind::kSeen, p, kNone});
  }
  for (std::uint32_t n = 0; n < view.nodes().size(); ++n) {
    events.push_back({SceneEvent::Kind::kTap, n, n});
  }
  unsigned sum = 0;
  for (const double time : {1.0, 1e5}) {
    for (const SceneCommand& command : machine.step(time, events)) {
      if (command.action != kNone) sum += touch(view.name(view.actions()[command.action].address));
    }
  }
  for (std::uint32_t n = 0; n < view.nodes().size(); ++n) {
    const NodeTurn turn = machine.turn_of(n);
    const float square = turn.x * turn.x + turn.y * turn.y + turn.z * turn.z + turn.w * turn.w;
    if (!(square > 0.99f && square < 1.01f)) std::abort();
    sum += touch(view.name(view.nodes()[n].name)) + (machine.shown(n) ? 1u : 0u);
  }
  return sum;
}

/// Uses every accessor of an opened bundle as a renderer or tracker would.
unsigned walk(const BundleView& view) {
  unsigned sum = touch(view.meta()) + act(view);
  for (std::uint32_t m = 0; m < view.models().size(); ++m) {
    const ModelRecord& model = view.models()[m];
    sum += touch(view.name(model.name));
    for (std::uint32_t c = 0; c < model.chunk_count; ++c) {
      sum += walk_order(view, model.first_chunk + c);
    }
  }
  for (std::uint32_t g = 0; g < view.chunk_groups(); ++g) {
    const ChunkGroup group = view.chunk_group(g);
    const std::uint32_t stride = view.layouts()[view.models()[group.model].layout].stride;
    for (std::uint32_t c = 0; c < group.chunk_count; ++c) {
      const ChunkRecord& chunk = view.chunks()[group.first_chunk + c];
      sum += touch(view.name(view.materials()[chunk.material].name));
      for (std::uint32_t l = 0; l < chunk.level_count; ++l) {
        const LevelRecord& level = view.levels()[chunk.first_level + l];
        sum += touch(
            view.vertices().subspan(level.vertex_offset, std::size_t{level.vertex_count} * stride));
        sum += touch(view.indices().subspan(level.index_offset, level.index_count * 2));
      }
    }
  }
  for (std::uint32_t t = 0; t < view.textures().size(); ++t) {
    const TextureRecord& texture = view.textures()[t];
    for (std::uint32_t l = 0; l < texture.level_count; ++l) {
      const TextureLevelRecord& level = view.texture_levels()[texture.first_level + l];
      sum += touch(view.texture_data(t).subspan(level.offset, level.size));
      if (level.alpha_offset != kNoOffset) {
        sum += touch(view.texture_data(t).subspan(level.alpha_offset, level.size));
      }
    }
  }
  for (std::uint32_t s = 0; s < view.scenes().size(); ++s) {
    const SceneRecord& scene = view.scenes()[s];
    sum += touch(view.section(SectionType::kShadow, s));
    sum += view.patterns()[scene.pattern].width + view.models()[scene.model].layout;
  }
  for (std::uint32_t p = 0; p < view.patterns().size(); ++p) {
    sum += touch(view.name(view.patterns()[p].name)) + look(view, p);
    for (std::uint32_t s = 0; s < view.parameter_sets().size(); ++s) {
      const FeatureView features = view.features(p, view.parameter_sets()[s].id);
      sum += touch(features.keypoints) + touch(features.descriptors);
      sum += touch(view.feature_yml(p, view.parameter_sets()[s].id));
    }
  }
  return sum;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto input = std::as_bytes(std::span(data, size));
  std::vector<std::byte> bytes(input.begin(), input.end());
  if (size % 4 != 3) rehash(bytes);
  const Result<BundleView> view = BundleView::open(bytes);
  bool errors = false;
  const bool good = check_bundle(bytes, [&errors](const Issue& issue) {
    if (issue.kind == nullptr || issue.kind->id == nullptr) std::abort();
    errors = errors || issue.kind->severity == Severity::kError;
  });
  if (good == errors) std::abort();
  // What the checker passes has to open, and an error has to say what to do.
  if (good && !view) std::abort();
  if (!view) {
    if (view.error().code.empty() || view.error().cure.empty()) std::abort();
    return 0;
  }
  // Of what the checker passes, the visible content first passes, too.
  const auto first = encode_bundle(preview(*view));
  if (good && (!first || !first_error(*first).empty())) std::abort();
  // The answer depends on every byte that was touched, so the touching is not optimised away.
  return walk(*view) == 0xFFFFFFFFu ? -1 : 0;
}
