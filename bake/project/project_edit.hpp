// Changes to the text of modar.toml that leave every other byte unchanged: comments, order, spaces,
// and keys that this version does not know.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

#include "bake/json.hpp"
#include "formats/base/error.hpp"

namespace modar {

/// A short text that changes with the bytes of a project file.
std::string revision_of(std::string_view text);

/// A table of the file: [name], or the one of that index among [[name]].
struct TableName {
  std::string name;
  std::optional<std::size_t> index;
};

/// How many tables [[name]] the text has. text: valid TOML, here and below.
std::size_t count_tables(const std::string& text, const std::string& name);

/// Gives a key of a table a value: a text, a number, a truth, or a list of these or of lists. key:
/// as modar.toml has it, "text.en" for one of a table within. [name] is made where it is missing.
/// Errors: kUsage "project.edit" (no such table, no such kind of value).
Result<std::string> set_key(const std::string& text, const TableName& table, const std::string& key,
                            const Json& value);
/// Without the key's line. The text itself where there is no such key. Errors: as set_key().
Result<std::string> remove_key(const std::string& text, const TableName& table,
                               const std::string& key);
/// With a table [[name]] of these keys behind the last one of its name, else at the end.
/// Errors: as set_key().
Result<std::string> add_table(const std::string& text, const std::string& name, const Json& keys);
/// Without a table and those within it ([[scene.label]]). Comments above it stay.
/// Errors: as set_key().
Result<std::string> remove_table(const std::string& text, const TableName& table);

/// A key's value as TOML: "[1, 2.5]"; nothing where the table has no such key.
std::optional<std::string> value_text(const std::string& text, const TableName& table,
                                      const std::string& key);

}  // namespace modar
