// Names of files.
#pragma once

#include <string>
#include <string_view>

#include "formats/base/error.hpp"

namespace modar {

/// "dir/spider.obj" -> "spider.obj"; empty of "dir/".
inline std::string file_name(std::string_view path) {
  return std::string(path.substr(path.rfind('/') + 1));  // npos + 1 is 0
}

/// "dir/spider.v2.obj" -> "spider.v2"; of ".hidden" all.
inline std::string file_stem(std::string_view path) {
  std::string name = file_name(path);
  const std::size_t dot = name.rfind('.');
  if (dot != 0 && dot != std::string::npos && name != "..") name.resize(dot);
  return name;
}

inline bool is_web_address(std::string_view path) {
  return path.starts_with("https://") || path.starts_with("http://");
}

/// The error of a file that is not there. For a web address it says how to get the file.
inline tl::unexpected<Error> missing_file(std::string_view path, Error error) {
  if (is_web_address(path)) {
    error.cause = "'" + std::string(path) + "' is a web address, and only files are read";
    error.cure = "download it (curl -LO '" + std::string(path) + "'), and name the file";
  }
  return tl::unexpected<Error>(std::move(error));
}

}  // namespace modar
