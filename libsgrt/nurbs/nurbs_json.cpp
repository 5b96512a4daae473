// nurbs.json: {"schema", "degree": [c, d], "knots": [[...], [...]], "size": [nu, nv], "control_points": [[x, y, z],
// ...] (v fastest), "weights": [...]}; a curve has one of each; without weights they are 1.
#include "nurbs/nurbs_json.hpp"

#include <nlohmann/json.hpp>

#include "core/note_json.inl"

namespace sgrt {
namespace {

constexpr const char* kSchema = "sgrt-nurbs/1";

[[noreturn]] void refuse(const std::string& message) {
  fail(Status::kFormat, message);
}

const Json& array_at(const Json& object, const char* key) {
  const auto found = object.find(key);
  if (found == object.end()) refuse(std::string(key) + ": missing");
  if (!found->is_array()) refuse(std::string(key) + ": expected an array, got " + found->type_name());
  return *found;
}

double number(const Json& value, const std::string& path) {
  if (!value.is_number()) refuse(path + ": expected a number, got " + value.type_name());
  return value.get<double>();
}

std::vector<double> numbers(const Json& value, const std::string& path) {
  if (!value.is_array()) refuse(path + ": expected an array of numbers, got " + value.type_name());
  std::vector<double> out;
  for (const Json& x : value) out.push_back(number(x, path + "[" + std::to_string(out.size()) + "]"));
  return out;
}

// `sides` whole numbers from 1 on.
std::vector<int> counts(const Json& json, const char* key, std::size_t sides) {
  const std::vector<double> values = numbers(array_at(json, key), key);
  if (values.size() != sides) {
    refuse(std::string(key) + ": " + std::to_string(values.size()) + " numbers, expected " + std::to_string(sides) +
           (sides == 1 ? " for a curve" : " for a surface"));
  }
  std::vector<int> out;
  for (double x : values) {
    if (!(x >= 1 && x <= kMaxKnots && x == static_cast<int>(x)))
      refuse(std::string(key) + ": " + text_of(x) + ", expected a whole number from 1 on");
    out.push_back(static_cast<int>(x));
  }
  return out;
}

struct Read {
  std::vector<SplineBasis> basis;
  Points points;
  Eigen::VectorXd weights;
};

Read read(const Json& json, std::size_t sides) {
  if (!json.is_object()) refuse(std::string("nurbs: expected an object, got ") + json.type_name());
  const auto schema = json.find("schema");
  if (schema == json.end() || !schema->is_string()) refuse("schema: missing, expected 'sgrt-nurbs/1'");
  if (!is_text(*schema, kSchema))
    refuse("schema: expected 'sgrt-nurbs/1', got " + in_quotes(schema->get<std::string>()));
  const std::vector<int> degree = counts(json, "degree", sides), size = counts(json, "size", sides);
  const Json& knots = array_at(json, "knots");
  if (knots.size() != sides) refuse("knots: expected " + std::to_string(sides) + " arrays");
  Read out;
  double count = 1;
  for (std::size_t d = 0; d < sides; ++d) {
    const std::string path = "knots[" + std::to_string(d) + "]";
    out.basis.push_back({degree[d], numbers(knots[d], path)});
    check_basis(out.basis.back(), size[d], path);
    count *= size[d];
  }
  const Json& points = array_at(json, "control_points");
  if (static_cast<double>(points.size()) != count) {
    refuse("control_points: " + std::to_string(points.size()) + " points, expected " + text_of(count) + " from size");
  }
  out.points.resize(static_cast<Eigen::Index>(points.size()), 3);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const std::vector<double> x = numbers(points[i], "control_points[" + std::to_string(i) + "]");
    if (x.size() != 3) refuse("control_points[" + std::to_string(i) + "]: expected 3 numbers");
    out.points.row(static_cast<Eigen::Index>(i)) << x[0], x[1], x[2];
  }
  if (json.contains("weights")) {
    const std::vector<double> w = numbers(json.at("weights"), "weights");
    if (w.size() != points.size()) {
      refuse("weights: " + std::to_string(w.size()) + ", expected one a control point, " +
             std::to_string(points.size()));
    }
    out.weights = Eigen::Map<const Eigen::VectorXd>(w.data(), static_cast<Eigen::Index>(w.size()));
  }
  return out;
}

// What is wrong with the numbers is wrong with the text.
template <class Make>
auto formatted(Make&& make) {
  try {
    return make();
  } catch (const Error& error) {
    fail(error.status() == Status::kInvalidArgument ? Status::kFormat : error.status(), error.what());
  }
}

std::string write(const SplineBasis* basis, std::size_t sides, const Points& points, const Eigen::VectorXd& weights) {
  Note degree = Note::list(), knots = Note::list(), size = Note::list(), rows = Note::list(), w = Note::list();
  for (std::size_t d = 0; d < sides; ++d) {
    degree.add(basis[d].degree);
    knots.add(basis[d].knots);
    size.add(basis[d].size());
  }
  for (Eigen::Index i = 0; i < points.rows(); ++i) {
    rows.add(Note::list(points(i, 0), points(i, 1), points(i, 2)));
    w.add(weights.size() > 0 ? weights[i] : 1.0);
  }
  Note note = Note::object();
  note.append("schema", kSchema);
  note.append("degree", std::move(degree));
  note.append("knots", std::move(knots));
  note.append("size", std::move(size));
  note.append("control_points", std::move(rows));
  note.append("weights", std::move(w));
  return note_text(note, "nurbs", NoteForm::kCompact);
}

}  // namespace

NurbsCurve curve_from_json(const char* text, std::size_t size) {
  return formatted([&] {
    Read r = read(parse_json(text, size, "nurbs").root, 1);
    return make_nurbs_curve({std::move(r.basis[0]), std::move(r.points), std::move(r.weights)});
  });
}

NurbsSurface surface_from_json(const char* text, std::size_t size) {
  return formatted([&] {
    Read r = read(parse_json(text, size, "nurbs").root, 2);
    return make_nurbs_surface(
        {{std::move(r.basis[0]), std::move(r.basis[1])}, std::move(r.points), std::move(r.weights)});
  });
}

std::string to_json(const NurbsCurve& curve) {
  return write(&curve.basis, 1, curve.points, curve.weights);
}

std::string to_json(const NurbsSurface& surface) {
  return write(surface.basis, 2, surface.points, surface.weights);
}

}  // namespace sgrt
