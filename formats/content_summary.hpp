// The content summary of a bundle: its records once more as JSON lines that any text editor shows,
// and the size and hash of every section. It is derived from the other sections (bundle.md, Content
// summary), so the checker can compare it with them: a program that changes a section and puts its
// hash right leaves the summary behind.
#pragma once

#include <string>

#include "formats/bundle_writer.hpp"

namespace modar {

/// The summary of a content whose `summary` is still empty.
std::string content_summary_of(const BundleContent& content);

}  // namespace modar
