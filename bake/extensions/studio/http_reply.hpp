// What the page asks and what the studio answers, without the library that carries them.
#pragma once

#include <map>
#include <string>
#include <utility>
#include <vector>

#include "bake/json.hpp"
#include "formats/base/error.hpp"

namespace modar {

/// A request that came through the gate of server.cpp.
struct Call {
  std::string method;                        ///< GET, POST, PUT, DELETE
  std::string path;                          ///< below the secret: "api/project", decoded
  std::map<std::string, std::string> query;  ///< the first of each name
  std::string body;                          ///< of POST: JSON
  std::string upload;                        ///< of PUT: path of a file that holds the body
  /// A value of the query; empty if none.
  [[nodiscard]] std::string asked(const std::string& name) const {
    const auto found = query.find(name);
    return found == query.end() ? std::string() : found->second;
  }
};

struct Answer {
  int status = 200;
  std::string type = "application/json";
  std::string body;
  std::string file;  ///< path of a file that is sent in place of the body; empty: the body
  std::vector<std::pair<std::string, std::string>> headers;
};

Answer answer_of(const Json& json, int status = 200);
Answer jpeg_answer(std::string bytes);
/// {"error", "cure", "code", "where", "file", "line"} with the status of its code.
Answer answer_of(const Error& error);
/// The members of an error as the page reads them.
Json json_of(const Error& error);
Error unknown_verb(const Call& call);

template <class T>
Answer answer_or_error(const Result<T>& result) {
  return result ? answer_of(*result) : answer_of(result.error());
}

}  // namespace modar
