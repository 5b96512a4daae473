// What a file is to say, as a tree that is built, copied and dropped like any value. nlohmann-json's tree asks for
// memory when it is destroyed, and ends the program where there is none; so it reads, and this writes
// (core/note_json.inl). One that was moved from may be dropped or assigned to, nothing else.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

namespace sgrt {

class Note {
 public:
  enum class Kind : std::uint8_t { kNull, kBool, kInteger, kUnsigned, kReal, kText, kList, kObject };

  Note() = default;  // null
  explicit Note(Kind kind) : kind_(kind), branch_(kind < Kind::kText ? nullptr : std::make_unique<Branch>()) {}
  Note(double value) : kind_(Kind::kReal), real_(value) {}
  template <class T, std::enable_if_t<std::is_integral_v<T>, int> = 0>
  Note(T value) : integer_(static_cast<std::int64_t>(value)) {
    kind_ = std::is_same_v<T, bool> ? Kind::kBool : std::is_unsigned_v<T> ? Kind::kUnsigned : Kind::kInteger;
  }
  Note(std::string value) : Note(Kind::kText) { branch_->text = std::move(value); }
  Note(const char* value) : Note(std::string(value)) {}
  template <class T>
  Note(const std::vector<T>& values) : Note(Kind::kList) {
    branch_->items.assign(values.begin(), values.end());
  }
  Note(const Note& other)
      : kind_(other.kind_),
        integer_(other.integer_),
        real_(other.real_),
        branch_(other.branch_ ? std::make_unique<Branch>(*other.branch_) : nullptr) {}
  Note(Note&& other) noexcept = default;
  Note& operator=(const Note& other) { return *this = Note(other); }
  Note& operator=(Note&& other) noexcept = default;
  ~Note() = default;

  static Note object() { return Note(Kind::kObject); }
  template <class... Items>
  static Note list(Items&&... items) {
    Note note(Kind::kList);
    (note.add(std::forward<Items>(items)), ...);
    return note;
  }

  Kind kind() const { return kind_; }
  double real() const { return real_; }
  std::int64_t integer() const { return integer_; }  // of kBool, kInteger and, by its bits, kUnsigned
  const std::string& text() const { return branch_->text; }
  bool is_text(const std::string& other) const { return kind_ == Kind::kText && branch_->text == other; }
  // Of a list or an object; of anything else there are none.
  std::size_t size() const { return branch_ ? branch_->items.size() : 0; }
  const Note& item(std::size_t i) const { return branch_->items[i]; }
  const std::string& name(std::size_t i) const { return branch_->names[i]; }  // of an object

  // Of a list.
  void add(Note item) { branch_->items.push_back(std::move(item)); }
  // The field of an object, NULL where it has none.
  const Note* find(const std::string& name) const {
    for (std::size_t i = 0; kind_ == Kind::kObject && i < size(); ++i)
      if (branch_->names[i] == name) return &branch_->items[i];
    return nullptr;
  }
  // The field, a null at the end where there was none. What is no object becomes one.
  Note& operator[](const std::string& name) {
    if (kind_ != Kind::kObject) *this = object();
    if (const Note* found = find(name)) return branch_->items[static_cast<std::size_t>(found - branch_->items.data())];
    branch_->names.push_back(name);
    return branch_->items.emplace_back();
  }
  // A field of an object that has none of this name.
  void append(std::string name, Note value) {
    branch_->names.push_back(std::move(name));
    branch_->items.push_back(std::move(value));
  }
  void erase(const std::string& name) {
    const Note* found = find(name);
    if (!found) return;
    const auto i = found - branch_->items.data();
    branch_->items.erase(branch_->items.begin() + i);
    branch_->names.erase(branch_->names.begin() + i);
  }

 private:
  struct Branch {
    std::string text;
    std::vector<std::string> names;  // of an object's items, in their order
    std::vector<Note> items;
  };

  Kind kind_ = Kind::kNull;
  std::int64_t integer_ = 0;
  double real_ = 0;
  std::unique_ptr<Branch> branch_;
};

// The numbers of a vector; the rows of a matrix. What is not finite is written as null.
template <class Vector>
Note list_of(const Vector& v) {
  Note list = Note::list();
  for (std::ptrdiff_t i = 0; i < v.size(); ++i) list.add(v[i]);
  return list;
}

template <class Matrix>
Note rows_of(const Matrix& m) {
  Note rows = Note::list();
  for (std::ptrdiff_t i = 0; i < m.rows(); ++i) rows.add(list_of(m.row(i)));
  return rows;
}

}  // namespace sgrt
