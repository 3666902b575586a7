// A page's accessibility statement, built as the EU's model statement is (Commission Implementing
// Decision (EU) 2018/1523): what the publisher says of itself, what the page's tests prove, and
// what they do not.
#pragma once

#include <string>
#include <vector>

#include "bake/json.hpp"
#include "formats/base/error.hpp"

namespace modar {

/// Who publishes a page: the file of `modar web --statement`.
struct Publisher {
  std::string name;
  std::string date;         ///< of the statement, YYYY-MM-DD
  std::string feedback;     ///< address for those who meet a barrier: mailto:, https:, tel:
  std::string enforcement;  ///< address of the body that enforces accessibility
};

/// Errors: kInvalidInput "web.statement" where a part is missing or no such address or date; kIo.
Result<Publisher> read_publisher(const std::string& path);

/// The statement as an HTML document. texts: those of statements/LANGUAGE.json. page: title of the
/// page. undescribed: scenes that have no description in this language.
std::string statement_page(const Json& texts, const std::string& language, const std::string& page,
                           const Publisher& publisher, const std::vector<std::string>& undescribed);

}  // namespace modar
