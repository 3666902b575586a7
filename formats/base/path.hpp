// Names of files.
#pragma once

#include <string>
#include <string_view>

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

}  // namespace modar
