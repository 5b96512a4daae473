// Strict JSON text to a tree: at most 16 MiB, nested at most 16 deep, no key twice in an object, numbers read alike in
// every locale, the order of keys kept. For the *_json.cpp alone, which include <nlohmann/json.hpp> before it.
#pragma once

#include <algorithm>
#include <charconv>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "core/error.hpp"

namespace sgrt {

using Json = nlohmann::ordered_json;

// Takes a tree apart from its leaves up. nlohmann-json's own destructor asks for memory to do so, and where there is
// none it ends the program; of an empty array or object it asks for none.
inline void dismantle(Json& json) noexcept {
  if (auto* object = json.get_ptr<Json::object_t*>()) {
    for (auto& item : *object) dismantle(item.second);
    object->clear();
  } else if (auto* array = json.get_ptr<Json::array_t*>()) {
    for (Json& item : *array) dismantle(item);
    array->clear();
  }
}

// Whether it is this text. By == nlohmann-json makes a second tree, and ends the program where there is no memory for
// it.
inline bool is_text(const Json& json, const std::string& text) {
  return json.is_string() && json.get_ref<const std::string&>() == text;
}

// Owns a tree and takes it apart.
struct JsonTree {
  Json root;
  explicit JsonTree(Json&& tree) noexcept : root(std::move(tree)) {}
  JsonTree(JsonTree&&) = default;
  JsonTree& operator=(JsonTree&&) = delete;
  ~JsonTree() { dismantle(root); }
};

// Builds the tree as the parser reads: with a limit of depth, no key twice in an object, and numbers read without
// regard to the locale (nlohmann-json reads them with strtod).
class JsonBuilder : public nlohmann::json_sax<Json> {
 public:
  explicit JsonBuilder(const char* name) : name_(name) {}
  ~JsonBuilder() override { dismantle(root); }
  JsonBuilder(const JsonBuilder&) = delete;
  JsonBuilder& operator=(const JsonBuilder&) = delete;
  Json root;

  bool null() override { return add(nullptr); }
  bool boolean(bool value) override { return add(value); }
  bool number_integer(std::int64_t value) override { return add(value); }
  bool number_unsigned(std::uint64_t value) override { return add(value); }
  bool string(std::string& value) override { return add(std::move(value)); }
  bool binary(Json::binary_t&) override { return false; }

  bool number_float(double, const std::string& token) override {
    std::string text = token;
    for (char& c : text) {
      if (std::string("0123456789+-eE").find(c) == std::string::npos) c = '.';  // the locale's decimal point
    }
    double value = 0;
    const std::from_chars_result result = std::from_chars(text.data(), text.data() + text.size(), value);
    if (result.ec != std::errc()) refuse("the number " + in_quotes(text) + " is out of range");
    return add(value);
  }

  bool start_object(std::size_t) override { return open(Json::object()); }
  bool start_array(std::size_t) override { return open(Json::array()); }
  bool end_object() override { return close(); }
  bool end_array() override { return close(); }

  bool key(std::string& name) override {
    if (!keys_.back().insert(name).second) refuse("the key " + in_quotes(name) + " stands twice in one object");
    key_ = std::move(name);
    return true;
  }

  bool parse_error(std::size_t position, const std::string&, const nlohmann::detail::exception& error) override {
    if (error.id == 406) refuse("a number is out of range near byte " + std::to_string(position));
    refuse("not JSON, syntax error near byte " + std::to_string(position));
  }

 private:
  template <class Value>
  bool add(Value&& value) {
    place(std::forward<Value>(value));
    return true;
  }

  template <class Value>
  Json& place(Value&& value) {
    if (open_.empty()) return root = std::forward<Value>(value);
    Json& into = *open_.back();
    if (into.is_array()) return into.emplace_back(std::forward<Value>(value));
    // Straight into the vector below: the map's own insertion searches all keys, which `keys_` has done.
    auto& object = into.get_ref<Json::object_t&>();
    if (object.size() == object.capacity()) grow(object);
    object.emplace_back(std::move(key_), std::forward<Value>(value));
    return object.back().second;
  }

  // More room. By itself the vector would copy its trees, because their keys are const, and destroy the old ones.
  static void grow(Json::object_t& object) {
    Json::object_t larger;
    larger.reserve(2 * object.size() + 4);
    for (const auto& item : object) larger.emplace_back(item.first, nullptr);
    auto to = larger.begin();
    for (auto& item : object) (to++)->second = std::move(item.second);
    object.swap(larger);
  }

  bool open(Json container) {
    constexpr std::size_t kMaxDepth = 16;
    if (open_.size() == kMaxDepth) fail(Status::kLimit, name_ + ": nested deeper than 16");
    open_.push_back(&place(std::move(container)));
    keys_.emplace_back();
    return true;
  }

  bool close() {
    open_.pop_back();
    keys_.pop_back();
    return true;
  }

  [[noreturn]] void refuse(const std::string& why) const { fail(Status::kFormat, name_ + ": " + why); }

  std::string name_;
  std::vector<Json*> open_;
  std::vector<std::set<std::string>> keys_;
  std::string key_;
};

// name: what the text is, for the message.
inline JsonTree parse_json(const char* text, std::size_t size, const char* name) {
  constexpr std::size_t kMaxBytes = 16 << 20;
  if (size > kMaxBytes) {
    fail(Status::kLimit, name + (": expected at most 16 MiB of text, got " + std::to_string(size) + " bytes"));
  }
  const std::size_t nul = std::find(text, text + size, '\0') - text;  // nlohmann-json takes it for the end
  if (nul < size) fail(Status::kFormat, name + (": not JSON, a NUL at byte " + std::to_string(nul)));
  JsonBuilder builder(name);
  Json::sax_parse(text, text + size, &builder);
  return JsonTree(std::move(builder.root));
}

}  // namespace sgrt
