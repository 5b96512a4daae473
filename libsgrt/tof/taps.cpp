// Loading and averaging of taps, see tof/taps.hpp; equations of docs/theory/tof.md.
#include "tof/taps.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <type_traits>

#include "rig/tof_unit.hpp"

namespace sgrt {
namespace {

template <class T>
void load_row(const char* from, std::int64_t stride, int width, float* to) {
  if (stride == sizeof(T)) {  // the usual case, written so that it vectorises
    for (int x = 0; x < width; ++x) {
      T value;
      std::memcpy(&value, from + x * sizeof(T), sizeof value);
      to[x] = static_cast<float>(value);
    }
    return;
  }
  for (int x = 0; x < width; ++x) {
    T value;
    std::memcpy(&value, from + x * stride, sizeof value);
    to[x] = static_cast<float>(value);
  }
}

// The value that a chi^2 of `dof` passes by a chance of a normal `z`: Wilson and Hilferty (1931).
double chi2_limit(int dof, double z) {
  const double a = 2.0 / (9 * dof);
  return dof * std::pow(1 - a + z * std::sqrt(a), 3);
}

// Sum over all rows and the frames [first, first + count), newest first; `total` frames in the view.
void block_mean(const std::vector<float>& frames, std::size_t frame_size, std::int64_t first, std::int64_t count,
                std::size_t rows, std::size_t stride, std::size_t x, float* mean) {
  for (std::size_t row = 0; row < rows; ++row) {
    float sum = 0;
    for (std::int64_t j = first; j < first + count; ++j)
      sum += frames[static_cast<std::size_t>(j) * frame_size + row * stride + x];
    mean[row] = sum / static_cast<float>(count);
  }
}

}  // namespace

double TapsView::low() const {
  return type == Type::kI16 ? -32768 : -std::numeric_limits<double>::infinity();
}

double TapsView::high() const {
  return type == Type::kI16 ? 32767 : type == Type::kU16 ? 65535 : std::numeric_limits<double>::infinity();
}

TapModel make_tap_model(const TofUnit& unit, bool integers) {
  constexpr double kMovedZ = 5, kRounding = 1.0 / 12, kNothing = 1e-12;
  constexpr int kMaxTaps = 32;  // as the rig's reader has it
  // On the stack: Eigen's decompositions free twice where there is no memory.
  const Eigen::Matrix<double, Eigen::Dynamic, 3, 0, kMaxTaps, 3> model = tap_model(unit.tap_phase_rad);
  const Eigen::JacobiSVD<std::decay_t<decltype(model)>> svd(model, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const Eigen::MatrixXd inverse = svd.matrixV() * svd.singularValues().cwiseInverse().asDiagonal() *
                                  svd.matrixU().leftCols(3).transpose();  // 3 x taps
  TapModel m;
  m.taps = static_cast<int>(model.rows());
  m.null_count = m.taps - 3;
  const auto round = [&](double w) { return std::abs(w) < kNothing ? 0.F : static_cast<float>(w); };
  m.weights.reserve(static_cast<std::size_t>(inverse.size()));
  m.null_space.reserve(static_cast<std::size_t>(m.null_count) * static_cast<std::size_t>(m.taps));
  for (Eigen::Index k = 0; k < inverse.cols(); ++k) {
    for (Eigen::Index i = 0; i < 3; ++i) m.weights.push_back(round(inverse(i, k)));
  }
  for (Eigen::Index j = 3; j < m.taps; ++j) {
    for (Eigen::Index k = 0; k < m.taps; ++k) m.null_space.push_back(round(svd.matrixU()(k, j)));
  }
  if (!unit.differential) {
    const double read = unit.read_noise_e / unit.electrons_per_count;
    m.gain = static_cast<float>(1 / unit.electrons_per_count);
    m.floor = static_cast<float>(read * read + (integers ? kRounding : 0));
  }
  if (m.null_count > 0) m.moved_limit = static_cast<float>(chi2_limit(m.null_count, kMovedZ));
  return m;
}

void load_taps(const TapsView& view, std::int64_t frame, std::int64_t frequency, int y, float* out, int stride) {
  const int width = static_cast<int>(view.shape[4]);
  for (std::int64_t k = 0; k < view.shape[2]; ++k) {
    const char* from = static_cast<const char*>(view.data) + frame * view.strides[0] + frequency * view.strides[1] +
                       k * view.strides[2] + y * view.strides[3];
    float* to = out + k * stride;
    switch (view.type) {
      case TapsView::Type::kU16:
        load_row<std::uint16_t>(from, view.strides[4], width, to);
        break;
      case TapsView::Type::kI16:
        load_row<std::int16_t>(from, view.strides[4], width, to);
        break;
      case TapsView::Type::kF32:
        load_row<float>(from, view.strides[4], width, to);
        break;
    }
  }
}

// A block of as many older frames joins the mean of the newest n while the two agree (eq. 8): so slow drifts are seen
// as well as jumps. Taps of unknown noise are not averaged.
void average_taps(const TapsView& view, const TapModel& model, int y, float low, float high, float* out, int stride,
                  float* frames_used, float* share, AverageWork& work) {
  constexpr double kAgreeZ = 3.3;
  const std::int64_t total = view.shape[0], frequencies = view.shape[1];
  const auto rows = static_cast<std::size_t>(frequencies * model.taps), step = static_cast<std::size_t>(stride);
  const std::size_t frame_size = rows * step;
  work.frames.resize(frame_size * static_cast<std::size_t>(total));
  for (std::int64_t j = 0; j < total; ++j) {
    for (std::int64_t f = 0; f < frequencies; ++f)
      load_taps(view, total - 1 - j, f, y,
                work.frames.data() + static_cast<std::size_t>(j) * frame_size +
                    static_cast<std::size_t>(f * model.taps) * step,
                stride);
  }
  for (float& tap : work.frames) {
    if (!(tap > low && tap < high)) tap = std::numeric_limits<float>::quiet_NaN();
  }
  const auto limit = static_cast<float>(chi2_limit(static_cast<int>(rows), kAgreeZ));
  const bool known = model.gain > 0 || model.floor > 0;
  std::vector<float> mean(rows), older(rows);
  for (std::size_t x = 0; x < static_cast<std::size_t>(view.shape[4]); ++x) {
    std::int64_t n = 1;
    block_mean(work.frames, frame_size, 0, 1, rows, step, x, mean.data());
    while (known && n < total) {
      const std::int64_t m = std::min(n, total - n);
      block_mean(work.frames, frame_size, n, m, rows, step, x, older.data());
      const float shares = 1 / static_cast<float>(n) + 1 / static_cast<float>(m);
      float chi2 = 0;
      for (std::size_t row = 0; row < rows; ++row) {
        const float d = mean[row] - older[row], level = (mean[row] + older[row]) / 2;
        chi2 += d * d / ((model.gain * std::max(level, 0.F) + model.floor) * shares);
      }
      if (!(chi2 <= limit)) break;
      const float weight = static_cast<float>(m) / static_cast<float>(n + m);
      for (std::size_t row = 0; row < rows; ++row) mean[row] += weight * (older[row] - mean[row]);
      n += m;
    }
    for (std::size_t row = 0; row < rows; ++row) out[row * step + x] = mean[row];
    frames_used[x] = static_cast<float>(n);
    share[x] = 1 / static_cast<float>(n);
  }
}

}  // namespace sgrt
