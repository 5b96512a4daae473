// See laser/candidates.hpp.
#include "laser/candidates.hpp"

#include <algorithm>
#include <cmath>

#include "core/median.hpp"
#include "laser/kernels.hpp"

namespace sgrt {
namespace {

constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
constexpr float kFwhm = 2.3548F;  // over sigma

// Levelled, so that sums and differences stay finite.
void read_line(const Lines& lines, int line, float* v) {
  const int n = lines.width();
  lines.read(line, 0, n, v);
  level(v, n, lines.clip);
}

// The mean of the flanks on both sides of a peak; of one where the other lies outside.
float flank(const float* v, int n, int at, int half) {
  double sum = 0, count = 0;
  for (int k = half + 1; k <= 2 * half; ++k) {
    for (const int i : {at - k, at + k}) {
      if (i < 0 || i >= n) continue;
      sum += v[i];
      ++count;
    }
  }
  return count > 0 ? static_cast<float>(sum / count) : v[at];
}

// Every peak of a line, the brightest first, none nearer to another than the window's half width.
void search(const float* v, int n, int half, float min_signal, float* smooth, LineCandidates& out) {
  constexpr int kTries = 12;
  for (int i = 0; i < n; ++i) smooth[i] = (v[std::max(0, i - 1)] + 2 * v[i] + v[std::min(n - 1, i + 1)]) / 4;
  const float floor = *std::min_element(smooth, smooth + n);
  std::vector<bool> taken(static_cast<std::size_t>(n));
  for (int t = 0; t < kTries && out.count < kMaxCandidates; ++t) {
    int at = -1;
    for (int i = 0; i < n; ++i) {
      if (!taken[i] && (at < 0 || smooth[i] > smooth[at])) at = i;
    }
    if (at < 0 || smooth[at] - floor < min_signal) return;
    for (int i = std::max(0, at - half); i <= std::min(n - 1, at + half); ++i) taken[i] = true;
    const bool top = (at == 0 || smooth[at - 1] <= smooth[at]) && (at + 1 == n || smooth[at + 1] <= smooth[at]);
    int end = at;  // of a plateau
    while (end + 1 < n && smooth[end + 1] == smooth[at]) ++end;
    if (end > at && end - at < 2 * half) at = (at + end) / 2;
    const float background = flank(v, n, at, half), contrast = smooth[at] - background;
    if (!top || contrast < min_signal) continue;
    const HalfWidths w =
        half_widths(v, n, static_cast<float>(at), background, std::max(v[at], smooth[at]) - background);
    if (!(w.left + w.right > 0)) continue;
    out.add({at, static_cast<float>(at), contrast, background, (w.left + w.right) / kFwhm});
  }
}

kernels::LinePeak strongest(const Run& run, const Lines& lines, int line, int half, std::vector<float>& buffer) {
  const int n = lines.width();
  kernels::LinePeak peak;
  const bool avx2 = run.isa == Isa::kAvx2;
  if (const unsigned char* bytes = lines.bytes(line)) {
    (avx2 ? kernels::line_peak_u8_avx2 : kernels::line_peak_u8_baseline)(bytes, n, {half}, &peak);
    return peak;
  }
  read_line(lines, line, buffer.data());
  (avx2 ? kernels::line_peak_f32_avx2 : kernels::line_peak_f32_baseline)(buffer.data(), n, {half}, &peak);
  return peak;
}

// A value from about the middle of a line's grey levels.
float level_of(const Lines& lines, int line, const std::vector<float>& buffer) {
  const int n = lines.width(), step = std::max(1, n / 64);
  const unsigned char* bytes = lines.bytes(line);
  double sum = 0;
  int count = 0;
  for (int i = step / 2; i < n; i += step, ++count) sum += bytes ? static_cast<float>(bytes[i]) : buffer[i];
  return static_cast<float>(sum / count);
}

}  // namespace

HalfWidths half_widths(const float* v, int n, float centre, float background, float contrast, float share_of_height) {
  const float half = background + contrast * share_of_height;
  const auto walk = [&](int step) {
    int i = static_cast<int>(std::lround(centre));
    if (i < 0 || i >= n) return kNaN;
    while (v[i] > half) {
      const int next = i + step;
      if (next < 0 || next >= n) return kNaN;
      if (v[next] <= half) {
        const float share = (v[i] - half) / (v[i] - v[next]);
        return std::abs(static_cast<float>(i) + static_cast<float>(step) * share - centre);
      }
      i = next;
    }
    return kNaN;
  };
  return {walk(-1), walk(1)};
}

float asymmetry_of(const float* v, int n, float centre, float width, float background, float contrast) {
  constexpr float kTop = 0.85F, kFoot = 0.25F;
  int best = std::clamp(static_cast<int>(std::lround(centre)), 0, n - 1);
  const int reach = 1 + static_cast<int>(width);
  for (int i = std::max(0, best - reach), end = std::min(n - 1, best + reach); i <= end; ++i)
    best = v[i] > v[best] ? i : best;
  const auto peak = static_cast<float>(best);
  const HalfWidths top = half_widths(v, n, peak, background, contrast, kTop);
  const HalfWidths foot = half_widths(v, n, peak, background, contrast, kFoot);
  if (!(foot.left + foot.right > 0 && top.left + top.right > 0)) return 0;
  return ((foot.right - foot.left) - (top.right - top.left)) / (foot.left + foot.right);
}

LineCandidates find_candidates(const Run& run, const Lines& lines, int line, int half, float min_signal,
                               std::vector<float>& buffer) {
  const int n = lines.width();
  LineCandidates out;
  const kernels::LinePeak p = strongest(run, lines, line, half, buffer);
  const float contrast = p.value - p.background;
  const bool sole =
      p.centre == p.centre && contrast >= min_signal && p.second - p.background < std::max(min_signal, contrast / 2);
  if (!sole && p.value - level_of(lines, line, buffer) < min_signal) return out;
  if (sole && p.width > 0) {
    Candidate& c = out.first;
    out.count = 1;
    c = {p.at, p.centre, contrast, p.background, p.width};
    c.asymmetry = p.asymmetry;
    c.sum = p.value < lines.clip ? p.signal : 0;
    return out;
  }
  if (lines.bytes(line)) read_line(lines, line, buffer.data());
  search(buffer.data(), n, half, min_signal, buffer.data() + n, out);
  return out;
}

int window_of(const Run& run, const Lines& lines, float min_signal) {
  constexpr int kLines = 48, kFirst = 8, kLeast = 3, kMost = 40;
  constexpr float kWindow = 2.7F;  // sigmas: wider ones add more noise than they add stripe
  std::vector<float> buffer(static_cast<std::size_t>(2 * lines.width())), widths;
  widths.reserve(kLines);
  for (int half : {kFirst, 24}) {
    widths.clear();
    const int step = std::max(1, lines.count() / kLines);
    for (int line = step / 2; line < lines.count(); line += step) {
      if (lines.width() < 4 * half + 1) continue;
      const LineCandidates c = find_candidates(run, lines, line, half, min_signal, buffer);
      if (c.count > 0) widths.push_back(c.first.width);
    }
    if (widths.size() < 3) continue;
    const int wanted = static_cast<int>(std::lround(kWindow * median(widths)));
    if (wanted <= 2 * half) return std::clamp(wanted, kLeast, kMost);
  }
  return kFirst;
}

namespace {

struct Piece {
  double strength = 0;
  int length = 0;
  double score() const { return strength / std::max(1, length) * std::min(length, 32); }
};

// Joins each candidate to the nearest one of the lines just before.
std::vector<Piece> join(std::vector<LineCandidates>& lines) {
  constexpr int kGap = 3;
  constexpr float kStep = 3.5F;  // px a line: 74 degrees
  std::vector<Piece> pieces;
  pieces.reserve(lines.size());
  for (std::size_t y = 0; y < lines.size(); ++y) {
    bool used[kGap + 1][kMaxCandidates] = {};
    LineCandidates& line = lines[y];
    for (int c = 0; c < line.count; ++c) {
      Candidate& own = line[c];
      for (std::size_t gap = 1; gap <= kGap && gap <= y && own.piece < 0; ++gap) {
        LineCandidates& before = lines[y - gap];
        int best = -1;
        float nearest = kStep * static_cast<float>(gap);
        for (int b = 0; b < before.count; ++b) {
          const float d = std::abs(before[b].centre - own.centre);
          if (used[gap][b] || d > nearest) continue;
          nearest = d;
          best = b;
        }
        if (best < 0) continue;
        used[gap][best] = true;
        own.piece = before[best].piece;
      }
      if (own.piece >= 0) continue;
      own.piece = static_cast<int>(pieces.size());
      pieces.push_back({});
    }
  }
  return pieces;
}

// The width across the stripe: along the line it grows by the slope.
float across(const std::vector<LineCandidates>& lines, std::size_t y, const Candidate& c) {
  constexpr std::size_t kReach = 3;
  float low = 0, high = 0;
  int steps = 0;
  const auto look = [&](std::size_t at, float& place) {
    for (int b = 0; b < lines[at].count; ++b) {
      if (lines[at][b].piece != c.piece) continue;
      place = lines[at][b].centre;
      return true;
    }
    return false;
  };
  for (std::size_t k = kReach; k >= 1 && steps == 0; --k) {
    if (y >= k && y + k < lines.size() && look(y - k, low) && look(y + k, high)) steps = static_cast<int>(2 * k);
  }
  const float slope = steps > 0 ? (high - low) / static_cast<float>(steps) : 0;
  return c.width / std::sqrt(1 + slope * slope);
}

// Where no line has a second candidate there is nothing to weigh.
void take_all(const std::vector<LineCandidates>& lines, std::vector<Piece>& pieces, int min_length,
              std::vector<LineReason>& reason, std::vector<int>& chosen) {
  reason.assign(lines.size(), LineReason::kNoStripe);
  chosen.assign(lines.size(), -1);
  for (const LineCandidates& line : lines) {
    if (line.count > 0) ++pieces[static_cast<std::size_t>(line.first.piece)].length;
  }
  for (std::size_t y = 0; y < lines.size(); ++y) {
    if (lines[y].count == 0) continue;
    chosen[y] = 0;
    const bool island = pieces[static_cast<std::size_t>(lines[y].first.piece)].length < min_length;
    reason[y] = island ? LineReason::kAmbiguous : LineReason::kNone;
  }
}

}  // namespace

void choose(std::vector<LineCandidates>& lines, int min_length, std::vector<LineReason>& reason,
            std::vector<int>& chosen) {
  constexpr double kLike = 0.7;
  std::vector<Piece> pieces = join(lines);
  const auto one = [](const LineCandidates& line) { return line.count <= 1; };
  if (std::all_of(lines.begin(), lines.end(), one)) return take_all(lines, pieces, min_length, reason, chosen);
  std::vector<float> widths;
  widths.reserve(lines.size());
  for (std::size_t y = 0; y < lines.size(); ++y) {
    if (lines[y].count > 0) widths.push_back(across(lines, y, lines[y].first));
  }
  const float usual = median(widths);
  for (std::size_t y = 0; y < lines.size(); ++y) {
    for (int c = 0; c < lines[y].count; ++c) {
      const Candidate& own = lines[y][c];
      const double off = std::log(static_cast<double>(across(lines, y, own)) / usual) / 0.4;
      pieces[own.piece].strength += own.contrast * std::exp(-off * off / 2);
      ++pieces[own.piece].length;
    }
  }
  reason.assign(lines.size(), LineReason::kNoStripe);
  chosen.assign(lines.size(), -1);
  for (std::size_t y = 0; y < lines.size(); ++y) {
    double best = 0, second = 0;
    for (int c = 0; c < lines[y].count; ++c) {
      const double score = pieces[lines[y][c].piece].score();
      if (score > best) {
        second = best;
        best = score;
        chosen[y] = c;
      } else {
        second = std::max(second, score);
      }
    }
    if (chosen[y] < 0) continue;
    const bool island = pieces[lines[y][chosen[y]].piece].length < min_length;
    reason[y] = island || second > kLike * best ? LineReason::kAmbiguous : LineReason::kNone;
  }
}

}  // namespace sgrt
