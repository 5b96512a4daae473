// Notes from trees that were read, and to text in the forms of nlohmann-json's dump(2) and dump(). For the *_json.cpp
// alone, which include <nlohmann/json.hpp> before it.
#pragma once

#include <cmath>

#include "core/note.hpp"
#include "core/strict_json.inl"

namespace sgrt {

inline Note note_of(const Json& json) {
  switch (json.type()) {
    case Json::value_t::boolean:
      return json.get<bool>();
    case Json::value_t::number_integer:
      return json.get<std::int64_t>();
    case Json::value_t::number_unsigned:
      return json.get<std::uint64_t>();
    case Json::value_t::number_float:
      return json.get<double>();
    case Json::value_t::string:
      return json.get_ref<const std::string&>();
    case Json::value_t::array: {
      Note list = Note::list();
      for (const Json& item : json) list.add(note_of(item));
      return list;
    }
    case Json::value_t::object: {
      Note object = Note::object();
      for (const auto& [name, value] : json.get_ref<const Json::object_t&>()) object.append(name, note_of(value));
      return object;
    }
    default:
      return {};
  }
}

enum class NoteForm : std::uint8_t { kLines, kCompact };

class NoteWriter {
 public:
  explicit NoteWriter(NoteForm form) : lines_(form == NoteForm::kLines) {}
  std::string text;

  void write(const Note& note, int depth) {
    switch (note.kind()) {
      case Note::Kind::kNull:
        text += "null";
        break;
      case Note::Kind::kBool:
        text += note.integer() != 0 ? "true" : "false";
        break;
      case Note::Kind::kInteger:
        text += std::to_string(note.integer());
        break;
      case Note::Kind::kUnsigned:
        text += std::to_string(static_cast<std::uint64_t>(note.integer()));
        break;
      case Note::Kind::kReal:
        put(note.real());
        break;
      case Note::Kind::kText:
        put(note.text());
        break;
      default:
        put_branch(note, depth);
    }
  }

 private:
  void put(double value) {
    char digits[64];
    if (std::isfinite(value))
      text.append(digits, nlohmann::detail::to_chars(digits, digits + sizeof digits, value));
    else
      text += "null";
  }

  void put(const std::string& value) { text += Json(value).dump(); }  // throws where it is not UTF-8

  void put_branch(const Note& note, int depth) {
    const bool object = note.kind() == Note::Kind::kObject;
    text += object ? '{' : '[';
    for (std::size_t i = 0; i < note.size(); ++i) {
      if (i > 0) text += ',';
      open_line(depth + 1);
      if (object) {
        put(note.name(i));
        text += lines_ ? ": " : ":";
      }
      write(note.item(i), depth + 1);
    }
    if (note.size() > 0) open_line(depth);
    text += object ? '}' : ']';
  }

  void open_line(int depth) {
    if (!lines_) return;
    text += '\n';
    text.append(static_cast<std::size_t>(2 * depth), ' ');
  }

  bool lines_;
};

// name: what the text is, for the message.
inline std::string note_text(const Note& note, const char* name, NoteForm form = NoteForm::kLines) {
  try {
    NoteWriter writer(form);
    writer.write(note, 0);
    return std::move(writer.text);
  } catch (const nlohmann::detail::exception&) {
    fail(Status::kInvalidArgument, name + std::string(": a text that is not UTF-8"));
  }
}

}  // namespace sgrt
