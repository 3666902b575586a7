#include "server_address.hpp"

#include <cstdlib>

#include <curl/curl.h>

namespace modar::fetch {

std::string server_address(const std::string& url_or_folder) {
  std::string base = url_or_folder;
  while (base.size() > 1 && base.back() == '/') base.pop_back();
  if (base.find("://") != std::string::npos) return base;
  char* absolute = ::realpath(base.c_str(), nullptr);
  if (absolute == nullptr) return {};
  CURLU* parts = curl_url();
  curl_url_set(parts, CURLUPART_SCHEME, "file", 0);
  curl_url_set(parts, CURLUPART_PATH, absolute, CURLU_URLENCODE);
  char* text = nullptr;
  if (curl_url_get(parts, CURLUPART_URL, &text, 0) == CURLUE_OK) base = text;
  curl_free(text);
  curl_url_cleanup(parts);
  std::free(absolute);
  return base;
}

}  // namespace modar::fetch
