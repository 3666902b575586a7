// The rules of check_content() by subject. Internal to this folder.
#pragma once

#include <cstdint>
#include <initializer_list>
#include <string>

#include "bake/check/content/content_check.hpp"
#include "bake/check/verdict.hpp"

namespace modar {

/// The bundle, and where findings go.
class ContentLog {
 public:
  ContentLog(const BundleView& view, const IssueSink& sink, const ContentOptions& how)
      : bundle(view), options(how), sink_(sink) {}

  /// place: faults in the bundle's bytes.
  void tell(WorkstationRule rule, std::string where, const void* place, std::string detail);
  [[nodiscard]] std::string label(const char* what, NameRef name) const {
    return std::string(what) + " '" + std::string(bundle.name(name)) + "'";
  }
  /// Does a rule that reads these sections have to be run? All do where no change is known.
  [[nodiscard]] bool concerns(std::initializer_list<SectionType> types) const;
  [[nodiscard]] bool good() const { return good_; }
  /// Nothing else is to be looked for.
  [[nodiscard]] bool done() const { return !good_ && options.first_only; }

  const BundleView& bundle;
  const ContentOptions& options;

 private:
  const IssueSink& sink_;
  bool good_ = true;
};

/// Names, widths, scores, scenes and lights as the meta text states them; the paper's parameter
/// sets; names, textures and layouts that nothing uses.
void check_statements(ContentLog& log);
/// Figures of models; the order of vertices and triangles, cones, texture coordinates.
void check_meshes(ContentLog& log);
/// Sizes, figures and mip levels.
void check_textures(ContentLog& log);
/// Tracker records, small pictures and colours of patterns against the record's picture.
void check_pictures(ContentLog& log);
/// Places and shadows of scenes, and draw orders, from the geometry.
void check_placements(ContentLog& log);

}  // namespace modar
