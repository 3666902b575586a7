// Cuts pictures, packs the parts, moves pixels and uvs.
#include "bake/texture/atlas/atlas.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <map>
#include <memory>
#include <optional>
#include <utility>

#include <glm/common.hpp>

#include "bake/image/image.hpp"
#include "bake/image/resample.hpp"
#include "bake/mesh/pack/chunk.hpp"
#include "bake/texture/atlas/atlas_layout.hpp"
#include "bake/texture/coverage.hpp"

namespace modar {
namespace {

/// Pixels of a picture that a cell is wide. Finer cells cut closer and take longer. [4, 16]
constexpr std::uint32_t kCell = 8;
/// Cells along a side at most: a picture of 16,384 has cells of 32.
constexpr std::uint32_t kMostCells = 512;
/// Texels of ETC1 with mip levels in the bytes of one vertex.
constexpr double kVertexTexels = 24;
/// Texels around each part; the widest that fits is used. Wider keep more mip levels clean and
/// waste more of a page.
constexpr std::array<std::uint32_t, 3> kGutters = {16, 8, 4};
/// Blocks of textures: parts begin on them.
constexpr std::uint32_t kBlock = 4;
/// Texels of gutter in a cut's price. Fewer leave small parts, which fill pages better and need
/// more vertices.
constexpr double kCutGutter = 2;
/// Steps between the least density and the pictures' own.
constexpr int kScaleSteps = 8;
/// Largest share of the bytes that an automatic atlas may keep. Higher makes atlases for little
/// gain.
constexpr double kWorthBytes = 2.0 / 3;
// The same of the materials.
constexpr double kWorthDraws = 0.5;
// Decibels that an automatic atlas may lose, compared with separate pictures.
constexpr double kMostLoss = 1.5;

/// A picture of the mesh.
struct Sheet {
  std::uint32_t use = 0;
  std::uint32_t width = 0;
  std::uint32_t height = 0;
  bool opaque = true;
  double least_scale = 1;  ///< at which it would be baked apart, or 1
  [[nodiscard]] AtlasSize scaled(int step) const {
    const double scale = least_scale + (1 - least_scale) * step / kScaleSteps;
    const auto side = [&](std::uint32_t whole) {
      return static_cast<std::uint32_t>(std::max(1.0, std::round(whole * scale)));
    };
    return {side(width), side(height)};
  }
};

/// A rectangle of a sheet: the uvs of the triangles there.
struct Part {
  std::uint32_t sheet = 0;
  glm::dvec2 low{1e9};
  glm::dvec2 high{-1e9};
};

/// The part's texels on a sheet of this size, gutters among them; they may be beyond its edges.
struct PartTexels {
  std::int64_t left = 0;
  std::int64_t top = 0;
  AtlasSize size;
};

PartTexels texels_of_part(const Part& part, AtlasSize sheet, std::uint32_t gutter) {
  const auto span = [&](double low, double high, std::uint32_t side) {
    const auto first = static_cast<std::int64_t>(std::floor(low * side)) - gutter;
    const auto end = static_cast<std::int64_t>(std::ceil(high * side)) + gutter;
    const auto length = static_cast<std::uint32_t>(std::max<std::int64_t>(end - first, 1));
    return std::pair(first, (length + kBlock - 1) / kBlock * kBlock);
  };
  const auto [left, width] = span(part.low.x, part.high.x, sheet.width);
  const auto [top, height] = span(part.low.y, part.high.y, sheet.height);
  return {left, top, {width, height}};
}

/// What one atlas is made of, and where it goes.
struct Plan {
  std::vector<Sheet> sheets;
  std::vector<Part> parts;
  std::vector<std::uint32_t> part_of;  ///< of each triangle; kNone: stays unchanged
  int step = 0;                        ///< of Sheet::scaled()
  std::uint32_t gutter = 0;
  AtlasPages layout;

  [[nodiscard]] PartTexels texels(std::size_t part) const {
    return texels_of_part(parts[part], sheets[parts[part].sheet].scaled(step), gutter);
  }
  [[nodiscard]] std::vector<AtlasSize> sizes(int at_step, std::uint32_t with_gutter) const {
    std::vector<AtlasSize> sizes;
    for (const Part& part : parts) {
      sizes.push_back(texels_of_part(part, sheets[part.sheet].scaled(at_step), with_gutter).size);
    }
    return sizes;
  }
};

/// A triangle's corner on a mask: v upwards, not wrapped around.
std::array<double, 2> mask_corner(const glm::dvec2& uv) {
  constexpr double kInside = 1 - 1e-9;
  return {std::clamp(uv.x, 0.0, kInside), 1 - std::clamp(uv.y, 0.0, kInside)};
}

std::array<std::array<double, 2>, 3> mask_corners(const TriMesh& mesh, std::size_t triangle) {
  std::array<std::array<double, 2>, 3> corners;
  for (std::size_t i = 0; i < 3; ++i) {
    corners[i] = mask_corner(mesh.uvs[mesh.triangles[triangle][i]]);
  }
  return corners;
}

/// Cuts one sheet: appends its parts to the plan and gives them their triangles.
void cut_sheet(const TriMesh& mesh, const std::vector<std::uint32_t>& triangles,
               std::uint32_t number, Plan& plan) {
  const Sheet& sheet = plan.sheets[number];
  const std::uint32_t side =
      std::max(kCell, (std::max(sheet.width, sheet.height) + kMostCells - 1) / kMostCells);
  CoverageMask mask =
      make_coverage((sheet.width + side - 1) / side, (sheet.height + side - 1) / side);
  AtlasCells cells{mask.width, mask.height, {}};
  const auto cell_at = [&](const glm::dvec2& uv) {
    const auto along = [](double at, std::uint32_t count) {
      return static_cast<std::size_t>(std::clamp(at * count, 0.0, count - 1.0));
    };
    return along(uv.y, cells.height) * cells.width + along(uv.x, cells.width);
  };
  for (const std::uint32_t t : triangles) cover_triangle(mask, mask_corners(mesh, t));
  for (const std::uint8_t covered : mask.covered) {
    cells.vertices.push_back(covered != 0 ? 0 : AtlasCells::kNotShown);
  }
  // Three corners of triangles, each of which six triangles share: half a vertex a triangle.
  const auto centre = [&](std::uint32_t t) {
    const auto& [a, b, c] = mesh.triangles[t];
    return (mesh.uvs[a] + mesh.uvs[b] + mesh.uvs[c]) / 3.0;
  };
  std::vector<std::uint32_t> counts(cells.vertices.size(), 0);
  for (const std::uint32_t t : triangles) ++counts[cell_at(centre(t))];
  for (std::size_t i = 0; i < counts.size(); ++i) {
    if (counts[i] != 0) cells.vertices[i] = static_cast<std::int32_t>((counts[i] + 1) / 2);
  }
  const std::vector<AtlasBox> boxes =
      cut_into_boxes(cells, {double(side), kCutGutter, kVertexTexels});
  std::vector<std::uint32_t> box_of(cells.vertices.size(), 0);
  for (std::uint32_t b = 0; b < boxes.size(); ++b) {
    for (std::uint32_t y = boxes[b].top; y < boxes[b].bottom; ++y) {
      std::fill_n(box_of.data() + std::size_t{y} * cells.width + boxes[b].left,
                  boxes[b].right - boxes[b].left, b);
    }
  }
  std::vector<std::uint32_t> part_of_box(boxes.size(), kNone);
  for (const std::uint32_t t : triangles) {
    std::uint32_t& part = part_of_box[box_of[cell_at(centre(t))]];
    if (part == kNone) {
      part = static_cast<std::uint32_t>(plan.parts.size());
      plan.parts.push_back({number});
    }
    plan.part_of[t] = part;
    for (const std::uint32_t v : mesh.triangles[t]) {
      plan.parts[part].low = glm::min(plan.parts[part].low, mesh.uvs[v]);
      plan.parts[part].high = glm::max(plan.parts[part].high, mesh.uvs[v]);
    }
  }
}

/// Places the parts: on the smallest pages for the least density, then as densely as these allow,
/// then with gutters as wide. False where a part is larger than a page.
bool place_parts(std::uint32_t max_side, Plan& plan) {
  std::optional<AtlasPages> found = pack_rectangles(plan.sizes(0, kGutters.back()), max_side);
  if (!found) return false;
  plan.step = 0;
  plan.gutter = kGutters.back();
  plan.layout = std::move(*found);
  const std::vector<AtlasSize> pages = plan.layout.pages;
  const auto fits = [&](int step, std::uint32_t gutter) {
    std::optional<AtlasPages> trial = pack_rectangles(plan.sizes(step, gutter), pages);
    if (!trial) return false;
    plan.layout = std::move(*trial);
    plan.step = step;
    plan.gutter = gutter;
    return true;
  };
  const auto scaled = [](const Sheet& sheet) { return sheet.least_scale < 1; };
  if (std::any_of(plan.sheets.begin(), plan.sheets.end(), scaled)) {
    for (int step = kScaleSteps; step > 0 && !fits(step, kGutters.back()); --step) continue;
  } else {
    plan.step = kScaleSteps;
  }
  for (std::size_t i = 0; i + 1 < kGutters.size() && !fits(plan.step, kGutters[i]); ++i) continue;
  return true;
}

/// Squared differences of the visible texels.
struct Loss {
  double squares = 0;
  std::uint64_t count = 0;
  void add(const RgbaImage& a, const RgbaImage& b, const CoverageMask& shown) {
    for (std::size_t i = 0; i < shown.covered.size(); ++i) {
      if (shown.covered[i] == 0) continue;
      for (std::size_t c = 0; c < 3; ++c) {
        const double off = double(a.pixels[4 * i + c]) - b.pixels[4 * i + c];
        squares += off * off;
      }
      count += 3;
    }
  }
  /// As psnr_db(): 99 where nothing differs.
  [[nodiscard]] double decibels() const {
    return squares > 0 ? 10 * std::log10(255.0 * 255.0 * static_cast<double>(count) / squares) : 99;
  }
};

/// The pages' pixels, which of them are shown, and what resampling lost.
struct Pages {
  std::vector<RgbaImage> images;
  std::vector<CoverageMask> shown;
  Loss atlas;
  Loss apart;
};

/// Copies a part with its gutters onto its page.
void copy_part(const RgbaImage& sheet, const CoverageMask& shown, const PartTexels& from,
               const AtlasPlace& place, Pages& pages) {
  RgbaImage& to = pages.images[place.page];
  for (std::uint32_t y = 0; y < from.size.height; ++y) {
    const auto source_y = static_cast<std::size_t>(
        std::clamp<std::int64_t>(from.top + y, 0, std::int64_t{sheet.height} - 1));
    for (std::uint32_t x = 0; x < from.size.width; ++x) {
      const auto source_x = static_cast<std::size_t>(
          std::clamp<std::int64_t>(from.left + x, 0, std::int64_t{sheet.width} - 1));
      const std::size_t source = source_y * sheet.width + source_x;
      const std::size_t target = std::size_t{place.top + y} * to.width + place.left + x;
      std::copy_n(&sheet.pixels[4 * source], 4, &to.pixels[4 * target]);
      pages.shown[place.page].covered[target] = shown.covered[source];
    }
  }
}

CoverageMask shown_of(const TriMesh& mesh, const Plan& plan, std::uint32_t sheet, AtlasSize size) {
  CoverageMask mask = make_coverage(size.width, size.height);
  for (std::size_t t = 0; t < plan.part_of.size(); ++t) {
    if (plan.part_of[t] == kNone || plan.parts[plan.part_of[t]].sheet != sheet) continue;
    cover_triangle(mask, mask_corners(mesh, t));
  }
  return mask;
}

Result<Pages> draw_pages(const TriMesh& mesh, const Plan& plan, const TextureUses& textures,
                         const AtlasOptions& options) {
  Pages pages;
  for (const AtlasSize& size : plan.layout.pages) {
    const std::size_t texels = std::size_t{size.width} * size.height;
    pages.images.push_back({size.width, size.height, std::vector<std::uint8_t>(4 * texels, 255)});
    pages.shown.push_back(make_coverage(size.width, size.height));
  }
  const ResampleOptions resample = {{}, options.textures.jobs};
  for (std::uint32_t s = 0; s < plan.sheets.size(); ++s) {
    const Sheet& sheet = plan.sheets[s];
    const AtlasSize size = sheet.scaled(plan.step);
    MODAR_ASSIGN(RgbaImage image, read_texture(textures.uses[sheet.use].path));
    if (size.width != sheet.width || size.height != sheet.height) {
      const CoverageMask shown = shown_of(mesh, plan, s, {sheet.width, sheet.height});
      const auto there_and_back = [&](std::uint32_t width, std::uint32_t height) {
        return resize(resize(image, width, height, resample), sheet.width, sheet.height, resample);
      };
      pages.atlas.add(image, there_and_back(size.width, size.height), shown);
      const TextureSize apart = texture_size({sheet.width, sheet.height}, options.textures);
      pages.apart.add(image, there_and_back(apart.width, apart.height), shown);
      image = resize(image, size.width, size.height, resample);
    }
    const CoverageMask shown = shown_of(mesh, plan, s, size);
    for (std::size_t p = 0; p < plan.parts.size(); ++p) {
      if (plan.parts[p].sheet != s) continue;
      copy_part(image, shown, plan.texels(p), plan.layout.places[p], pages);
    }
  }
  return pages;
}

/// A uv of a picture on the page of a part.
glm::dvec2 on_page(const Plan& plan, glm::dvec2 uv, std::uint32_t part) {
  const AtlasSize sheet = plan.sheets[plan.parts[part].sheet].scaled(plan.step);
  const PartTexels texels = plan.texels(part);
  const AtlasPlace& place = plan.layout.places[part];
  const AtlasSize page = plan.layout.pages[place.page];
  return {(uv.x * sheet.width - static_cast<double>(texels.left) + place.left) / page.width,
          (uv.y * sheet.height - static_cast<double>(texels.top) + place.top) / page.height};
}

/// A uv of a picture, in the page's longer sides: see TriMesh::picture_uvs.
glm::dvec2 on_picture(const Plan& plan, glm::dvec2 uv, std::uint32_t part) {
  const AtlasSize sheet = plan.sheets[plan.parts[part].sheet].scaled(plan.step);
  const AtlasSize page = plan.layout.pages[plan.layout.places[part].page];
  return uv * glm::dvec2(sheet.width, sheet.height) / double(std::max(page.width, page.height));
}

/// Doubles vertices that several parts use, and moves uvs to the pages.
void move_uvs(const Plan& plan, TriMesh& mesh) {
  constexpr std::uint32_t kUnseen = kNone - 1;
  std::vector<std::uint32_t> first(mesh.positions.size(), kUnseen);  // part of the first use
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> further;
  if (mesh.source_positions.empty()) {
    for (std::uint32_t v = 0; v < mesh.positions.size(); ++v) mesh.source_positions.push_back(v);
  }
  if (mesh.picture_uvs.empty()) {
    for (std::uint32_t v = 0; v < mesh.positions.size(); ++v) {
      mesh.picture_uvs.push_back(mesh.uvs[v]);
    }
  }
  const std::vector<glm::dvec2> before(mesh.uvs.begin(), mesh.uvs.end());
  const std::vector<glm::dvec2> pictures(mesh.picture_uvs.begin(), mesh.picture_uvs.end());
  const auto twice = [](auto& values, std::uint32_t v) {
    if (values.empty()) return;
    const auto value = values[v];
    values.push_back(value);
  };
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const std::uint32_t part = plan.part_of[t];
    for (std::uint32_t& v : mesh.triangles[t]) {
      const std::uint32_t old = v;
      const bool unseen = first[old] == kUnseen;
      if (unseen) first[old] = part;
      if (first[old] != part) {
        const auto next = static_cast<std::uint32_t>(mesh.positions.size());
        const auto [found, added] = further.try_emplace({old, part}, next);
        v = found->second;
        if (!added) continue;
        twice(mesh.positions, old);
        twice(mesh.source_positions, old);
        twice(mesh.normals, old);
        twice(mesh.colours, old);
        twice(mesh.vertex_bones, old);
        mesh.uvs.push_back(before[old]);
        mesh.picture_uvs.push_back(pictures[old]);
      } else if (!unseen) {
        continue;
      }
      if (part == kNone) continue;
      mesh.uvs[v] = on_page(plan, before[old], part);
      mesh.picture_uvs[v] = on_picture(plan, before[old], part);
    }
  }
}

bool differ_in_picture_only(const SourceMaterial& a, const SourceMaterial& b) {
  return a.ambient == b.ambient && a.diffuse == b.diffuse && a.specular == b.specular &&
         a.emission == b.emission && a.shininess == b.shininess && a.reflectance == b.reflectance &&
         a.metalness == b.metalness && a.opacity == b.opacity && a.two_sided == b.two_sided &&
         a.occluder() == b.occluder() && a.part == b.part;
}

/// The materials once the parts are on pages, and those of the triangles.
struct Materials {
  std::vector<SourceMaterial> materials;
  std::vector<std::uint32_t> pages;  ///< of each, kNone: unchanged
  std::vector<std::uint32_t> uses;   ///< of those that stay
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> number;  ///< of old and page
};

Materials merged_materials(const TriMesh& mesh, const Plan& plan,
                           const std::vector<std::uint32_t>& uses) {
  std::vector<std::vector<bool>> shows(mesh.materials.size(),
                                       std::vector<bool>(plan.layout.pages.size(), false));
  std::vector<bool> moves(mesh.materials.size(), false);
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    if (plan.part_of[t] == kNone) continue;
    moves[mesh.triangle_material[t]] = true;
    shows[mesh.triangle_material[t]][plan.layout.places[plan.part_of[t]].page] = true;
  }
  Materials merged;
  for (std::uint32_t m = 0; m < mesh.materials.size(); ++m) {
    const auto add = [&](std::uint32_t page) {
      merged.number[{m, page}] = static_cast<std::uint32_t>(merged.materials.size());
      merged.materials.push_back(mesh.materials[m]);
      merged.pages.push_back(page);
      merged.uses.push_back(uses[m]);
    };
    if (!moves[m]) add(kNone);
    for (std::uint32_t page = 0; page < plan.layout.pages.size(); ++page) {
      if (!shows[m][page]) continue;
      std::uint32_t same = 0;
      while (same < merged.pages.size() &&
             (merged.pages[same] != page ||
              !differ_in_picture_only(merged.materials[same], mesh.materials[m]))) {
        ++same;
      }
      if (same == merged.pages.size()) {
        add(page);
      } else {
        merged.number[{m, page}] = same;
      }
    }
  }
  return merged;
}

/// GPU bytes of the plan's pages over those of its sheets apart.
double bytes_ratio(const Plan& plan, const AtlasOptions& options) {
  std::vector<TexturePlan> apart;
  std::vector<TexturePlan> together;
  for (const Sheet& sheet : plan.sheets)
    apart.push_back({sheet.width, sheet.height, !sheet.opaque});
  for (const AtlasSize& page : plan.layout.pages) {
    together.push_back({page.width, page.height, !plan.sheets[0].opaque});
  }
  TextureOptions pages = options.textures;
  pages.max_side = options.max_side;
  return static_cast<double>(planned_bytes(together, pages)) /
         static_cast<double>(planned_bytes(apart, options.textures));
}

/// Parts of a mesh' chunks, at the least: one a material, or as many as its vertices need.
double draws_of(std::size_t materials, const TriMesh& mesh) {
  const std::size_t vertices = mesh.positions.size();
  return std::max(static_cast<double>(materials),
                  static_cast<double>(vertices) / chunk_vertices_for(vertices));
}

Diagnostic report_atlas(const Plan& plan, const Pages& pages, double bytes, std::size_t doubled,
                        const TriMesh& mesh) {
  const AtlasSize page = plan.layout.pages.front();
  char text[320];
  int length = std::snprintf(text, sizeof text,
                             "the visible parts of %zu pictures are on %zu of %u x %u in %zu "
                             "parts, %u texels or more apart: "
                             "%.0f %% of the bytes, %zu vertices more",
                             plan.sheets.size(), plan.layout.pages.size(), page.width, page.height,
                             plan.parts.size(), 2 * plan.gutter, 100 * bytes, doubled);
  if (pages.atlas.count == 0) {
    std::snprintf(text + length, sizeof text - static_cast<std::size_t>(length),
                  "; its texels are the pictures' own");
  } else {
    std::snprintf(text + length, sizeof text - static_cast<std::size_t>(length),
                  "; resampled it has %.2f dB, apart it would have %.2f", pages.atlas.decibels(),
                  pages.apart.decibels());
  }
  return {"texture.atlas",
          DiagnosticSeverity::kInfo,
          mesh.name,
          0,
          text,
          "--no-atlas keeps the pictures apart"};
}

/// Puts a plan into effect.
void take_atlas(const Plan& plan, Pages pages, double bytes, Materials merged, TriMesh& mesh,
                std::vector<std::uint32_t>& uses, TextureUses& textures, Report& report) {
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const std::uint32_t page =
        plan.part_of[t] == kNone ? kNone : plan.layout.places[plan.part_of[t]].page;
    mesh.triangle_material[t] = merged.number[{mesh.triangle_material[t], page}];
  }
  const std::size_t vertices = mesh.positions.size();
  move_uvs(plan, mesh);
  for (const Sheet& sheet : plan.sheets) textures.uses[sheet.use].replaced = true;
  std::vector<std::uint32_t> page_uses;
  for (std::size_t p = 0; p < pages.images.size(); ++p) {
    page_uses.push_back(static_cast<std::uint32_t>(textures.uses.size()));
    TextureUse use;
    use.path = mesh.name + (plan.sheets[0].opaque ? "-atlas" : "-atlas-alpha") +
               (p == 0 ? "" : "-" + std::to_string(p + 1));
    use.coverage = std::move(pages.shown[p]);
    use.image = std::make_shared<const RgbaImage>(std::move(pages.images[p]));
    textures.uses.push_back(std::move(use));
  }
  for (std::size_t m = 0; m < merged.materials.size(); ++m) {
    if (merged.pages[m] == kNone) continue;
    merged.uses[m] = page_uses[merged.pages[m]];
    merged.materials[m].diffuse_map.clear();
  }
  mesh.materials = std::move(merged.materials);
  uses = std::move(merged.uses);
  report.diagnostics.push_back(
      report_atlas(plan, pages, bytes, mesh.positions.size() - vertices, mesh));
}

/// The pictures of the mesh that may be repacked.
std::vector<Sheet> find_sheets(const AtlasOptions& options, const std::vector<std::uint32_t>& uses,
                               const TextureUses& textures) {
  std::vector<Sheet> sheets;
  std::vector<std::uint32_t> candidates;
  for (const std::uint32_t use : uses) {
    if (use == kNone || textures.uses[use].wrap != 0 || textures.uses[use].meshes != 1) continue;
    if (std::find(candidates.begin(), candidates.end(), use) != candidates.end()) continue;
    candidates.push_back(use);
  }
  if (candidates.size() < 2 && options.mode != AtlasMode::kAlways) return sheets;
  for (const std::uint32_t use : candidates) {
    const auto image = read_texture(textures.uses[use].path);
    if (!image) continue;  // told where it is baked
    const TextureSize apart = texture_size({image->width, image->height}, options.textures);
    const double scale =
        std::min({1.0, double(apart.width) / image->width, double(apart.height) / image->height});
    sheets.push_back({use, image->width, image->height, is_opaque(*image), scale});
  }
  return sheets;
}

Result<void> make_atlas(const AtlasOptions& options, std::vector<Sheet> sheets, TriMesh& mesh,
                        std::vector<std::uint32_t>& uses, TextureUses& textures, Report& report) {
  const bool asked = options.mode == AtlasMode::kAlways;
  if (sheets.size() < (asked ? 1u : 2u)) return {};
  StageTimer timer(report, "texture.atlas");
  Plan plan;
  plan.sheets = std::move(sheets);
  plan.part_of.assign(mesh.triangles.size(), kNone);
  std::vector<std::vector<std::uint32_t>> triangles(plan.sheets.size());
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    const std::uint32_t use = uses[mesh.triangle_material[t]];
    for (std::size_t s = 0; s < plan.sheets.size(); ++s) {
      if (plan.sheets[s].use == use) triangles[s].push_back(t);
    }
  }
  for (std::uint32_t s = 0; s < plan.sheets.size(); ++s) cut_sheet(mesh, triangles[s], s, plan);
  if (!place_parts(options.max_side, plan)) return {};
  const double bytes = bytes_ratio(plan, options);
  Materials merged = merged_materials(mesh, plan, uses);
  const bool fewer_draws = draws_of(merged.materials.size(), mesh) <=
                           kWorthDraws * draws_of(mesh.materials.size(), mesh);
  if (!asked && (bytes > 1 || (bytes >= kWorthBytes && !fewer_draws))) return {};
  MODAR_ASSIGN(Pages pages, draw_pages(mesh, plan, textures, options));
  if (!asked && pages.atlas.decibels() < pages.apart.decibels() - kMostLoss) return {};
  timer.done(plan.sheets.size(), pages.images.size());
  take_atlas(plan, std::move(pages), bytes, std::move(merged), mesh, uses, textures, report);
  return {};
}

}  // namespace

Result<void> make_atlases(const AtlasOptions& options, TriMesh& mesh,
                          std::vector<std::uint32_t>& uses, TextureUses& textures, Report& report) {
  if (options.mode == AtlasMode::kNever || mesh.uvs.empty()) return {};
  std::vector<Sheet> sheets = find_sheets(options, uses, textures);
  for (const bool opaque : {true, false}) {
    std::vector<Sheet> alike;
    for (const Sheet& sheet : sheets) {
      if (sheet.opaque == opaque) alike.push_back(sheet);
    }
    MODAR_TRY(make_atlas(options, std::move(alike), mesh, uses, textures, report));
  }
  return {};
}

}  // namespace modar
