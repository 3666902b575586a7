// A page that plays bundles in a browser, as a folder that any web server serves: the door of
// bake/extensions/web, with serve.hpp.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "formats/base/error.hpp"
#include "modar/release.hpp"

namespace modar {

struct SiteOptions {
  std::vector<std::string> bundles;  ///< files, shown in this order
  std::string title;                 ///< empty: the first bundle's name
  std::vector<std::string>
      languages;  ///< of the page's words, the first for those who have none of them; empty: all
  std::string words;  ///< folder of LANGUAGE.json, as those of the page; empty: none next to these
  bool room = false;  ///< add USDZ and GLB files of the models of each pattern
  std::vector<std::string> links;  ///< "Imprint=https://...": at the foot of the cover
  std::string
      texts;  ///< JSON {PATTERN: {LANGUAGE: {"name", "text", "alt"}}}; empty: those of the bundles
  std::string statement;  ///< JSON of a Publisher: add its accessibility statement; empty: none
  std::string release;  ///< address of a folder of `modar ship publish`, seen from the page; empty:
                        ///< no updates
  std::string trusted_key;  ///< file K.pub that its releases are verified with
  /// The newest release when the page is made: visitors' browsers believe none before it. 0: none.
  std::uint64_t release_epoch = 0;
  std::uint64_t release_version = 0;
  bool baker = false;  ///< add what bakes models of visitors' own in their browsers
  bool live = false;   ///< open pages show later writes, a second after them
  std::string page;    ///< folder that the preset `web` built; empty: find_page()
  std::string output;  ///< folder, made if absent; see claim_output_folder()
  bool force = false;  ///< write into a folder of other files as well
};

struct Site {
  std::vector<std::string> files;  ///< relative to the folder, in the order of writing
  std::uint64_t page_bytes = 0;    ///< of page and engines: what every site has
  std::uint64_t bundle_bytes = 0;  ///< of the bundles, without what pages do not read
  std::uint64_t packed_bytes = 0;  ///< of the same, as a first visit loads them; 0 for live pages
  std::uint64_t ranged_bytes =
      0;  ///< of these, in bundles of which it downloads visible parts only
  std::uint64_t trimmed_bytes = 0;    ///< left out of the bundles: see trim_to_publish()
  std::vector<std::string> warnings;  ///< what `modar check` would warn of: NEVER_SHOWN
};

/// The page installed with the programs, or built next to them.
/// Errors: kUnsupported "web.page".
Result<std::string> find_page();

/// The keys of SiteOptions::trusted_key. Errors: kInvalidInput "key.public"; kIo.
Result<RootSet> trusted_keys(const SiteOptions& options);

/// Writes the folder. The same bundles and options give the same bytes. sw.js comes last: what a
/// visitor keeps changes when all else is there. Errors: those of the bundles; kInvalidInput
/// "web.pattern", "web.texts", "web.statement", "key.public"; kUsage "web.trust"; kUsage
/// "web.language", "web.twice", "web.link", "web.words"; kUnsupported "web.page"; kIo.
Result<Site> write_site(const SiteOptions& options);

}  // namespace modar
