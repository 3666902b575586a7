// Nodes and actions of a bundle, from what its maker asks for: names become indices, pictures
// textures.
#pragma once

#include "bake/bundle/bundle_builder.hpp"
#include "bake/bundle/link_bundles.hpp"
#include "bake/json.hpp"
#include "bake/options/request.hpp"
#include "bake/report.hpp"
#include "formats/base/error.hpp"
#include "formats/bundle_writer.hpp"

namespace modar {

/// Adds nodes, actions and the textures of pictures. content: has the request's patterns, models
/// and scenes, which are content.scenes in this order. Errors: those of check_nodes() and of
/// bake_texture(); kUsage "scene.no-width" where a length is requested and the pattern's width is
/// unknown, "action.part" for a part that is not one of the model's materials; those of `source`.
/// source: empty: bake_media().
Result<void> add_nodes(const BakeRequest& request, BundleContent& content, Report& report,
                       const MediaSource& source = {});

/// Warnings of hidden nodes that no action shows.
std::vector<Diagnostic> never_shown(const BundleContent& content);

/// The member `nodes` of the meta text; null where no node has words.
Json node_texts(const BakeRequest& request);

}  // namespace modar
