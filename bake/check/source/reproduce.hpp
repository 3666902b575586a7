// The proof that a bake depends on its input and options alone.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "bake/bundle/bundle_builder.hpp"

namespace modar {

/// Bakes the request's files once more, in a process of its own, with other threads, another
/// folder, other paths of the same files, another time zone, locale and environment, and compares
/// its bytes with `baked`. words: the command line of the first bake from "bake" on.
/// Errors: kInternal "bake.not-reproducible" with the first byte that differs; kIo
/// "bake.reproduce" where the second bake could not run.
Result<void> prove_reproducible(const BakeRequest& request, const std::vector<std::string>& words,
                                std::span<const std::byte> baked);

}  // namespace modar
