#include "bake/json.hpp"

#include <cmath>
#include <nlohmann/json.hpp>

namespace modar {

struct Json::Value {
  nlohmann::ordered_json json;
};

Json::Json(std::nullptr_t) : value_(new Value{nullptr}) {}
Json::Json(std::string_view text) : value_(new Value{text}) {}
Json::Json(Number, bool truth) : value_(new Value{truth}) {}
Json::Json(Number, std::int64_t number) : value_(new Value{number}) {}
Json::Json(Number, std::uint64_t number) : value_(new Value{number}) {}
Json::Json(Number, double number) : Json(nullptr) {
  if (std::isfinite(number)) value_->json = number;
}
Json::Json(std::initializer_list<Member> members) : Json(object()) {
  for (const auto& [key, member] : members) value_->json[key] = member.value_->json;
}
Json::Json(const Json& other) : value_(new Value(*other.value_)) {}
Json::Json(Json&& other) noexcept = default;
Json& Json::operator=(Json other) noexcept {
  value_.swap(other.value_);
  return *this;
}
Json::~Json() = default;

Json Json::object() {
  Json json;
  json.value_->json = nlohmann::ordered_json::object();
  return json;
}

Json Json::array(std::initializer_list<Json> elements) {
  Json json;
  json.value_->json = nlohmann::ordered_json::array();
  for (const Json& element : elements) json.push_back(element);
  return json;
}

void Json::push_back(Json element) {
  value_->json.push_back(std::move(element.value_->json));
}

void Json::set(std::string_view key, Json value) {
  value_->json[std::string(key)] = std::move(value.value_->json);
}

bool Json::is_null() const {
  return value_->json.is_null();
}

bool Json::is_array() const {
  return value_->json.is_array();
}

std::vector<std::string> Json::keys() const {
  std::vector<std::string> keys;
  if (!value_->json.is_object()) return keys;
  for (const auto& member : value_->json.items()) keys.push_back(member.key());
  return keys;
}

std::size_t Json::size() const {
  return value_->json.is_structured() ? value_->json.size() : 0;
}

std::optional<Json> Json::at(std::size_t index) const {
  if (!is_array() || index >= size()) return std::nullopt;
  Json element;
  element.value_->json = value_->json[index];
  return element;
}

std::optional<Json> Json::find(std::string_view path) const {
  const nlohmann::ordered_json* place = &value_->json;
  while (true) {
    const std::size_t slash = std::min(path.find('/'), path.size());
    const auto found = place->find(std::string(path.substr(0, slash)));
    if (!place->is_object() || found == place->end()) return std::nullopt;
    place = &*found;
    if (slash == path.size()) break;
    path.remove_prefix(slash + 1);
  }
  Json member;
  member.value_->json = *place;
  return member;
}

std::vector<Json> Json::elements() const {
  std::vector<Json> all;
  for (std::size_t i = 0; is_array() && i < size(); ++i) all.push_back((*this)[i]);
  return all;
}

std::string Json::text_at(std::string_view path) const {
  return (*this)[path].text().value_or("");
}

double Json::number_at(std::string_view path) const {
  return (*this)[path].number().value_or(0);
}

std::optional<double> Json::number() const {
  return value_->json.is_number() ? std::optional(value_->json.get<double>()) : std::nullopt;
}

std::optional<std::uint64_t> Json::count() const {
  return value_->json.is_number_unsigned() ? std::optional(value_->json.get<std::uint64_t>())
                                           : std::nullopt;
}

std::optional<std::string> Json::text() const {
  return value_->json.is_string() ? std::optional(value_->json.get<std::string>()) : std::nullopt;
}

std::optional<bool> Json::truth() const {
  return value_->json.is_boolean() ? std::optional(value_->json.get<bool>()) : std::nullopt;
}

std::string Json::dump() const {
  return value_->json.dump(2, ' ', false, nlohmann::json::error_handler_t::replace) + "\n";
}

Json Json::parse(std::string_view text) {
  Json json;
  json.value_->json = nlohmann::ordered_json::parse(text, nullptr, false);
  return json.value_->json.is_discarded() ? Json() : json;
}

}  // namespace modar
